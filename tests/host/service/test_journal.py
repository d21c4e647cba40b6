"""Entries of systemd's journal: byte for byte, and as a journal's socket gets them."""

from __future__ import annotations

import logging
import os
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.service.journal import LONGEST_VALUE, JournalHandler, encode, is_in_use
from nondum.sdk.errors import NondumError, Problem

NAMES = st.from_regex(r"[A-Z][A-Z0-9_]{0,12}", fullmatch=True)


def decode(data: bytes) -> list[tuple[str, str]]:
    """What a journal makes of a datagram."""
    fields = []
    while data:
        line, _, rest = data.partition(b"\n")
        name, is_short, value = line.partition(b"=")
        if is_short:
            data = rest
        else:
            (length,) = struct.unpack_from("<Q", rest)
            value, data = rest[8 : 8 + length], rest[8 + length :]
            assert data[:1] == b"\n"
            data = data[1:]
        fields.append((name.decode(), value.decode()))
    return fields


def test_values_of_one_line_and_of_many_are_written_as_the_protocol_says() -> None:
    assert encode([("MESSAGE", "a = b"), ("X_1", "")]) == b"MESSAGE=a = b\nX_1=\n"
    assert encode([("MESSAGE", "a\nb\n")]) == (
        b"MESSAGE\n" + b"\x04\x00\x00\x00\x00\x00\x00\x00" + b"a\nb\n" + b"\n"
    )
    assert encode([("MESSAGE", "\xfc")]) == b"MESSAGE=\xc3\xbc\n"
    assert encode([]) == b""


@given(st.lists(st.tuples(NAMES, st.text(max_size=200)), max_size=6))
def test_what_is_written_is_what_is_read(fields: list[tuple[str, str]]) -> None:
    assert decode(encode(fields)) == fields


def test_an_entry_stays_within_a_datagram() -> None:
    assert len(encode([("MESSAGE", "x" * 1_000_000)])) == LONGEST_VALUE + len("MESSAGE=\n")


def test_journal_is_in_use_only_where_the_environment_names_that_very_stream() -> None:
    reader, writer = os.pipe()
    try:
        found = os.fstat(writer)
        named = {"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino}"}
        assert is_in_use(named, writer)
        assert not is_in_use({"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino + 1}"}, writer)
        assert not is_in_use({}, writer)
    finally:
        os.close(reader)
        os.close(writer)
    assert not is_in_use(named, writer)


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(tmp_path / "journal"))
        sock.settimeout(60)
        yield sock


@pytest.fixture
def log(journal: socket.socket) -> Iterator[logging.Logger]:
    handler = JournalHandler(journal.getsockname())
    logger = logging.Logger("nondum.test")
    logger.addHandler(handler)
    yield logger
    handler.close()


def entry(journal: socket.socket) -> dict[str, str]:
    return dict(decode(journal.recv(1 << 20)))


def test_record_has_message_priority_and_place(journal: socket.socket, log: logging.Logger) -> None:
    log.warning("two %s", "words")
    got = entry(journal)
    assert (got["MESSAGE"], got["PRIORITY"]) == ("two words", "4")
    assert (got["SYSLOG_IDENTIFIER"], got["NONDUM_LOGGER"]) == ("nondum", "nondum.test")
    assert got["CODE_FILE"].endswith("test_journal.py")
    assert got["CODE_FUNC"] == "test_record_has_message_priority_and_place"


@pytest.mark.parametrize(
    ("level", "priority"),
    [("critical", "2"), ("error", "3"), ("warning", "4"), ("info", "6"), ("debug", "7")],
)
def test_levels_have_the_priorities_of_syslog(
    journal: socket.socket, log: logging.Logger, level: str, priority: str
) -> None:
    getattr(log, level)("it")
    assert entry(journal)["PRIORITY"] == priority


def test_problem_is_found_by_its_code(journal: socket.socket, log: logging.Logger) -> None:
    problem = Problem("NO_MEMORY", "too little")
    log.warning("%s", problem)
    assert entry(journal)["NONDUM_CODE"] == "NO_MEMORY"
    log.warning("%s: %s", "it", NondumError(problem, Problem("DISK_FULL", "full")))
    codes = [value for name, value in decode(journal.recv(4096)) if name == "NONDUM_CODE"]
    assert codes == ["NO_MEMORY", "DISK_FULL"]


def test_fields_of_a_record_are_kept(journal: socket.socket, log: logging.Logger) -> None:
    log.info("it", extra={"journal": [("NONDUM_DRIVE", "sda1"), ("NONDUM_CODE", "DISK_FULL")]})
    got = entry(journal)
    assert (got["NONDUM_DRIVE"], got["NONDUM_CODE"]) == ("sda1", "DISK_FULL")


def test_exception_is_one_entry_of_many_lines(journal: socket.socket, log: logging.Logger) -> None:
    try:
        raise ValueError("no")
    except ValueError:
        log.exception("it failed")
    said = entry(journal)["MESSAGE"].splitlines()
    assert said[0] == "it failed"
    assert said[-1] == "ValueError: no"


def test_journal_that_is_not_read_is_not_waited_for(
    journal: socket.socket, log: logging.Logger
) -> None:
    """What was lost meanwhile is counted in the next entry that goes through."""
    for number in range(10_000):
        log.info("%d", number)
    journal.setblocking(False)
    heard = 0
    while True:
        try:
            journal.recv(4096)
        except BlockingIOError:
            break
        heard += 1
    journal.settimeout(60)
    log.info("the next one")
    assert int(entry(journal)["NONDUM_LOST"]) == 10_000 - heard


def test_what_no_journal_takes_is_written_as_text(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    handler = JournalHandler(str(tmp_path / "no-socket"))
    logger = logging.Logger("nondum.test")
    logger.addHandler(handler)
    logger.warning("hear me")
    handler.close()
    assert capsys.readouterr().err == "hear me\n"
