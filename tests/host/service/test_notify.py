"""A service manager is told by real datagrams, and never waited for."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.service.notify import LONGEST_STATUS, Notifier, encode


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(tmp_path / "notify"))
        sock.settimeout(60)
        yield sock


def asked(address: str, **more: str) -> Notifier:
    return Notifier.from_environment({"NOTIFY_SOCKET": address, **more})


@given(st.dictionaries(st.from_regex(r"[A-Z]{1,8}", fullmatch=True), st.text(), max_size=4))
def test_every_assignment_is_one_line(fields: dict[str, str]) -> None:
    lines = encode(**fields).decode().split("\n")
    assert [line.partition("=")[0] for line in lines[:-1]] == list(fields)
    assert lines[-1] == ""


def test_manager_hears_what_it_is_told_in_order(manager: socket.socket) -> None:
    notifier = asked(manager.getsockname())
    notifier.starting(1.5)
    notifier.ready()
    notifier.alive()
    notifier.status("2 components at work\nand a line")
    notifier.stopping()
    notifier.close()
    assert [manager.recv(4096) for _ in range(5)] == [
        b"EXTEND_TIMEOUT_USEC=1500000\n",
        b"READY=1\n",
        b"WATCHDOG=1\n",
        b"STATUS=2 components at work and a line\n",
        b"STOPPING=1\nSTATUS=stopping\n",
    ]


def test_manager_at_an_abstract_address_hears_too() -> None:
    name = f"nondum-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(f"\0{name}")
        sock.settimeout(60)
        notifier = asked(f"@{name}")
        notifier.ready()
        notifier.close()
        assert sock.recv(100) == b"READY=1\n"


def test_children_are_asked_for_nothing(manager: socket.socket) -> None:
    environment = {"NOTIFY_SOCKET": manager.getsockname(), "WATCHDOG_USEC": "1", "PATH": "/bin"}
    Notifier.from_environment(environment).close()
    assert environment == {"PATH": "/bin"}


def test_watchdog_counts_only_for_the_process_that_it_names(manager: socket.socket) -> None:
    address = manager.getsockname()
    for given_pid, allowed_s in (("", 30.0), (str(os.getpid()), 30.0), ("1", None)):
        notifier = asked(address, WATCHDOG_USEC="30000000", WATCHDOG_PID=given_pid)
        assert notifier.watchdog_s == allowed_s
        notifier.close()
    for nonsense in ("", "0", "-1", "soon"):
        notifier = asked(address, WATCHDOG_USEC=nonsense)
        assert notifier.watchdog_s is None
        notifier.close()


def test_nothing_is_sent_where_no_service_manager_asks() -> None:
    notifier = Notifier.from_environment({"WATCHDOG_USEC": "1000000"})
    assert (notifier.is_asked, notifier.watchdog_s) == (False, None)
    notifier.ready()
    notifier.close()


def test_manager_that_is_gone_is_told_no_more(tmp_path: Path) -> None:
    notifier = asked(str(tmp_path / "no-socket"))
    notifier.ready()
    assert not notifier.is_asked
    notifier.alive()


def test_manager_that_does_not_listen_is_not_waited_for(manager: socket.socket) -> None:
    notifier = asked(manager.getsockname())
    for _ in range(10_000):
        notifier.alive()
    assert notifier.is_asked
    notifier.close()


def test_status_is_no_longer_than_people_read(manager: socket.socket) -> None:
    notifier = asked(manager.getsockname())
    notifier.status("x" * 10_000)
    notifier.close()
    assert len(manager.recv(65_536)) == len("STATUS=\n") + LONGEST_STATUS
