"""RECORD does not say what the wheel holds, or says what cannot be."""

from __future__ import annotations

from tests.wheelhouse.hostile.case import (
    INIT,
    METADATA_PATH,
    RECORD,
    SOURCE,
    WHEEL_PATH,
    HostileWheel,
    built,
)
from tests.wheelhouse.hostile_wheels import METADATA, WHEEL, Lie, WheelBuilder, record_of

CODE = "WHEEL_RECORD"
FILES = {INIT: SOURCE, METADATA_PATH: METADATA, WHEEL_PATH: WHEEL}
TRUE = record_of(FILES, RECORD)


def _record(name: str, text: bytes) -> HostileWheel:
    return built(name, CODE, WheelBuilder(record=text))


def _row(line: bytes) -> bytes:
    """The true RECORD, with another row for the module."""
    rows = TRUE.splitlines(keepends=True)
    return line + b"".join(row for row in rows if not row.startswith(INIT.encode()))


def _without(path: str) -> bytes:
    return b"".join(
        row for row in TRUE.splitlines(keepends=True) if not row.startswith(path.encode())
    )


WHEELS: tuple[HostileWheel, ...] = (
    built("no-record", CODE, WheelBuilder(without=(RECORD,))),
    _record("empty-record", b""),
    _record("record-not-csv", b"a,b\n"),
    _record("record-not-text", b"\xff\xfe"),
    _record("record-with-zero-byte", b"\0,,\n" + TRUE),
    _record("other-bytes", record_of({**FILES, INIT: b"Y = 2\n"}, RECORD)),
    _record("other-size", TRUE.replace(b",6\n", b",7\n")),
    _record("size-is-no-number", TRUE.replace(b",6\n", b",six\n")),
    _record("member-unlisted", _without(INIT)),
    _record("metadata-unlisted", _without(METADATA_PATH)),
    _record("listed-twice", TRUE + TRUE.splitlines(keepends=True)[0]),
    _record("listed-not-there", record_of({**FILES, "evil/gone.py": b""}, RECORD)),
    _record("listed-outside", record_of({**FILES, "../../bin/evil": b""}, RECORD)),
    _record("no-digest", _row(f"{INIT},,\n".encode())),
    _record("weak-digest", _row(f"{INIT},md5=abc,6\n".encode())),
    _record("digest-is-no-base64", _row(f"{INIT},sha256=*,6\n".encode())),
    _record("digest-too-short", _row(f"{INIT},sha256=AAAA,6\n".encode())),
    _record(
        "vouches-for-itself",
        TRUE.replace(RECORD.encode() + b",,", RECORD.encode() + b",sha256=" + b"A" * 43 + b",1"),
    ),
    built(
        "checksum-wrong",
        CODE,
        WheelBuilder(lies={INIT: Lie(crc=1)}),
    ),
    built(
        "size-understated",
        CODE,
        WheelBuilder(lies={INIT: Lie(size=2)}),
    ),
    built(
        "bytes-are-not-deflated",
        CODE,
        WheelBuilder(
            lies={INIT: Lie(raw_name=None, method=0, local_method=None)},
            record=_row(f"{INIT},sha256={'A' * 43},6\n".encode()),
        ),
    ),
)
