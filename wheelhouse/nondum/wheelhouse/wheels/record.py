"""RECORD: what a wheel says that it holds, by digest and size ("Recording installed projects")."""

from __future__ import annotations

import base64
import binascii
import csv
import io
from collections.abc import Iterator, Mapping, Sequence

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.wheels.archive import MAX_MEMBERS, Member

MAX_BYTES = 8 * 1024**2
MAX_ROWS = 2 * MAX_MEMBERS


@frozen
class Row:
    """One row."""

    sha256: str
    """Hex; empty where none is given."""
    size: int | None


Record = Mapping[str, Row]
"""Path → row."""


def parse(text: str) -> Record:
    """The rows by path. Raises `ValueError` that says what is wrong with it."""
    record: dict[str, Row] = {}
    try:
        for row in csv.reader(io.StringIO(text)):
            if not row:
                continue
            if len(record) >= MAX_ROWS:
                raise ValueError(f"it has more than {MAX_ROWS} rows")
            if len(row) != 3:
                raise ValueError(f"row {','.join(row)[:60]!r} has not three columns")
            path, digest, size = row
            if path in record:
                raise ValueError(f"{path[:80]!r} stands twice")
            record[path] = Row(_hex(digest), _size(size))
    except csv.Error as error:
        raise ValueError(str(error)) from error
    return record


def flaws(members: Sequence[Member], record: Record, info: str) -> Iterator[str]:
    """Where the members and the rows do not match; `info` is the .dist-info folder."""
    may_lack_digest = {f"{info}/RECORD", f"{info}/RECORD.jws", f"{info}/RECORD.p7s"}
    for member in members:
        row = record.get(member.path)
        if member.path in may_lack_digest:
            continue
        if row is None:
            yield f"member {member.path!r} is not in RECORD"
        elif not row.sha256:
            yield f"member {member.path!r} has no digest in RECORD"
        elif row.size not in (None, member.size):
            yield f"member {member.path!r} has {member.size} bytes, RECORD says {row.size}"
    for path in record.keys() - {member.path for member in members} - may_lack_digest:
        yield f"RECORD lists {path[:80]!r}, which is not there"


def as_installed(record: Record, places: Mapping[str, str]) -> str:
    """RECORD of what was installed: `places` says where each member of the wheel went; members that
    are not in it were left out.

    >>> rows = {"a-1.data/purelib/a.py": Row("00" * 32, 1), "a-1.data/scripts/a": Row("ff" * 32, 2)}
    >>> as_installed(rows, {"a-1.data/purelib/a.py": "a.py"}).splitlines()
    ['a.py,sha256=AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA,1']
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    for path, row in record.items():
        if path in places:
            rows.writerow((places[path], _digest(row.sha256), "" if row.size is None else row.size))
    return text.getvalue()


def _digest(sha256: str) -> str:
    """A hex digest as RECORD has it; empty when there is none."""
    if not sha256:
        return ""
    return f"sha256={base64.urlsafe_b64encode(bytes.fromhex(sha256)).decode().rstrip('=')}"


def _hex(digest: str) -> str:
    """RECORD's `sha256=<urlsafe base64>` as hex; empty when it gives none."""
    if not digest:
        return ""
    method, _, value = digest.partition("=")
    if method != "sha256":
        raise ValueError(f"digest by {method[:20]!r}, not sha256")
    try:
        found = base64.b64decode(value + "=" * (-len(value) % 4), altchars=b"-_", validate=True)
    except (binascii.Error, ValueError) as error:
        raise ValueError(f"digest {value[:20]!r} is no base64") from error
    if len(found) != 32:
        raise ValueError(f"digest {value[:20]!r} is none of sha256")
    return found.hex()


def _size(text: str) -> int | None:
    if not text:
        return None
    if not text.isdecimal() or len(text) > 20:
        raise ValueError(f"size {text[:20]!r} is no number")
    return int(text)
