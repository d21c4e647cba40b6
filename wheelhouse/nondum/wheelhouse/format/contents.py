"""`CONTENTS`: the one list of what a payload is, and the bytes that are signed.

    nondum-payload 1
    id: org.example.blinker
    version: 1.0
    release: 7
    fleet:
    minimum-nondum: 0.1
    built: 2026-01-01T00:00:00Z

    <sha256>  <size>  <path>
    …

ASCII; headers in this order (`hosts`, which may be left out, after `fleet`); entries sorted by
path; every file but this one and its signature. So a list has one form: what is read is written as
the same bytes. A reader takes at most `MAX_BYTES`, once, and believes nothing else on the drive
before this is parsed.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from datetime import datetime
from typing import NoReturn

from packaging.version import InvalidVersion, Version

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import names

NAME = "CONTENTS"
SIGNATURE_NAME = "CONTENTS.sig"
MAX_BYTES = 256 * 1024
MAX_FILES = 512
MAX_FILE_BYTES = 8 * 1024**3
MAX_RELEASE = 2**53
FORMAT = "nondum-payload 1"
_ANY_FORMAT = FORMAT.partition(" ")[0].encode() + b" "
HEADER_KEYS = ("id", "version", "release", "fleet", "hosts", "minimum-nondum", "built")
"""In the order in which they stand."""
OPTIONAL_KEYS = ("hosts",)
MAX_HOSTS = 64
MAX_VERSION = 250
"""Characters of a version. Python makes no number of more than 4,300 digits (`int`)."""

_ENTRY = re.compile(r"([0-9a-f]{64})  (0|[1-9][0-9]{0,15})  (\S+)")
_BUILT = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ")
_FLEET = re.compile(r"[a-z0-9.-]{0,64}")
_HOST = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


@frozen
class Entry:
    """One file of a payload."""

    sha256: str
    size: int
    path: str
    """Relative to the payload folder, with slashes."""


@frozen
class Contents:
    """A parsed contents list."""

    payload_id: str
    version: str
    release: int
    """Orders releases of one payload for rollback protection."""
    fleet: str
    """Robots that it is meant for; empty: any."""
    minimum_nondum: str
    built: str
    """UTC, ISO 8601 to the second."""
    entries: tuple[Entry, ...]
    hosts: tuple[str, ...] = ()
    """Names of the only hosts that it is meant for; empty: any."""

    def to_bytes(self) -> bytes:
        """The list as it stands on a drive."""
        header = (
            ("id", self.payload_id),
            ("version", self.version),
            ("release", str(self.release)),
            ("fleet", self.fleet),
            *((("hosts", " ".join(self.hosts)),) if self.hosts else ()),
            ("minimum-nondum", self.minimum_nondum),
            ("built", self.built),
        )
        lines = [FORMAT, *(f"{key}: {value}".rstrip() for key, value in header), ""]
        lines += [f"{e.sha256}  {e.size}  {e.path}" for e in self.entries]
        return ("\n".join(lines) + "\n").encode("utf-8")  # ASCII, or it is refused when read

    @property
    def digest(self) -> str:
        """SHA-256 of the list's bytes: the payload's identity."""
        return hashlib.sha256(self.to_bytes()).hexdigest()

    @property
    def total_bytes(self) -> int:
        """Size of all files together."""
        return sum(entry.size for entry in self.entries)


def begins_wrong(data: bytes, where: str) -> Problem | None:
    """Why bytes are no contents list of any version, by their first ones; None: they may be one.

    For a list that no key vouches for, which must not be parsed: nothing of it is told.
    """
    if data.startswith(_ANY_FORMAT):
        return None
    if not data.isascii():
        return _flaw("CONTENTS_ENCODING", "is not a contents list", where)
    return _flaw("SCHEMA_VERSION", "is not a contents list", where)


def parse(data: bytes, where: str) -> Contents:
    """Check and parse a contents list. Raises `PayloadRefused` with everything wrong in it."""
    if len(data) > MAX_BYTES:
        _refuse("TOO_LARGE", f"is longer than {MAX_BYTES} bytes", where)
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError as error:
        _refuse("CONTENTS_ENCODING", f"byte {error.start} is not ASCII", where)
    lines = text.split("\n")
    if lines[0] != FORMAT:
        _refuse(
            "SCHEMA_VERSION",
            f"starts with {lines[0][:40]!r}, expected {FORMAT!r}",
            f"{where}:1",
            fix="build the payload with a nondum that this host knows, or update the host",
        )
    problems: list[Problem] = []
    header, first_entry = _header(lines, where, problems)
    entries = tuple(_entries(lines, first_entry, where, problems))
    problems.extend(_collisions(entries, where))
    if problems:
        raise PayloadRefused(*problems)
    return Contents(
        payload_id=header["id"],
        version=header["version"],
        release=int(header["release"]),
        fleet=header["fleet"],
        minimum_nondum=header["minimum-nondum"],
        built=header["built"],
        entries=entries,
        hosts=tuple(header.get("hosts", "").split()),
    )


def _header(lines: list[str], where: str, problems: list[Problem]) -> tuple[dict[str, str], int]:
    header: dict[str, str] = {}
    number = 1
    for number, line in enumerate(lines[1:], start=2):
        if not line:
            break
        key, colon, value = line.partition(":")
        if not colon or key not in HEADER_KEYS or key in header:
            problems.append(
                _flaw("CONTENTS_HEADER", f"unexpected header {line[:60]!r}", f"{where}:{number}")
            )
            continue
        last = next(reversed(header), key)
        if HEADER_KEYS.index(key) < HEADER_KEYS.index(last):
            told = f"header {key!r} stands after {last!r}; the order is {', '.join(HEADER_KEYS)}"
            problems.append(_flaw("CONTENTS_HEADER", told, f"{where}:{number}"))
        header[key] = " ".join(value.split())
        wanted = f" {header[key]}".rstrip()
        flaw = _header_flaw(key, header[key]) if value == wanted else "is not set off by one space"
        if flaw:
            problems.append(_flaw("CONTENTS_HEADER", f"{key}: {flaw}", f"{where}:{number}"))
    for key in HEADER_KEYS:
        if key not in (*header, *OPTIONAL_KEYS):
            problems.append(_flaw("CONTENTS_HEADER", f"header {key!r} is missing", where))
    return header, number


def _header_flaw(key: str, value: str) -> str | None:
    """What is wrong with a header's value, or None."""
    match key:
        case "id" if not names.PAYLOAD_ID.fullmatch(value):
            return f"{value[:60]!r} is not a reverse domain name like org.example.blinker"
        case "version" | "minimum-nondum" if not _is_version(value):
            return f"{value[:60]!r} is not a version (PEP 440) of at most {MAX_VERSION} characters"
        case "release" if (
            not re.fullmatch(r"0|[1-9][0-9]{0,15}", value) or int(value) > MAX_RELEASE
        ):
            return f"{value[:60]!r} is not a whole number of at most {MAX_RELEASE}"
        case "fleet" if not _FLEET.fullmatch(value):
            return f"{value[:60]!r} is not a fleet's name"
        case "hosts" if not 0 < len(value.split()) <= MAX_HOSTS or not all(
            _HOST.fullmatch(host) for host in value.split()
        ):
            return f"{value[:60]!r} is not one to {MAX_HOSTS} names of hosts"
        case "built" if not _is_moment(value):
            return f"{value[:60]!r} is not a time like 2026-01-01T00:00:00Z"
    return None


def _entries(lines: list[str], after: int, where: str, problems: list[Problem]) -> Iterator[Entry]:
    if lines[-1] != "":
        problems.append(_flaw("CONTENTS_ENTRY", "the last line is cut off", where))
    listed = lines[after:-1]
    if len(listed) > MAX_FILES:
        problems.append(_flaw("TOO_MANY_FILES", f"lists more than {MAX_FILES} files", where))
        return
    for number, line in enumerate(listed, start=after + 1):
        place = f"{where}:{number}"
        match = _ENTRY.fullmatch(line)
        if match is None:
            expected = "expected '<sha256>  <size>  <path>'"
            problems.append(_flaw("CONTENTS_ENTRY", f"{line[:80]!r}: {expected}", place))
            continue
        sha256, size, path = match[1], int(match[2]), match[3]
        if flaw := names.path_flaw(path):
            problems.append(_flaw("PATH_UNSAFE", f"path {path[:80]!r}: {flaw}", place))
        elif size > MAX_FILE_BYTES:
            problems.append(_flaw("TOO_LARGE", f"{path} is longer than 8 GiB", place))
        yield Entry(sha256, size, path)


def _collisions(entries: tuple[Entry, ...], where: str) -> Iterator[Problem]:
    paths = [entry.path for entry in entries]
    if paths != sorted(paths):
        yield _flaw("CONTENTS_ENTRY", "entries are not sorted by path", where)
    folded: dict[str, str] = {}
    for path in paths:
        other = folded.setdefault(path.lower(), path)
        if other is not path:
            yield _flaw("PATH_UNSAFE", f"{path!r} and {other!r} are one file on some drives", where)
        if path in (NAME, SIGNATURE_NAME):
            yield _flaw("CONTENTS_ENTRY", f"{path} may not list itself", where)


def _is_moment(value: str) -> bool:
    if not _BUILT.fullmatch(value):
        return False
    try:
        datetime.fromisoformat(value)
    except ValueError:
        return False
    return True


def _is_version(value: str) -> bool:
    if len(value) > MAX_VERSION:
        return False
    try:
        Version(value)
    except InvalidVersion:
        return False
    return True


def _flaw(code: str, message: str, where: str, fix: str = "") -> Problem:
    return Problem(code, message, where=where, fix=fix or "build the payload again")


def _refuse(code: str, message: str, where: str, fix: str = "") -> NoReturn:
    raise PayloadRefused(_flaw(code, message, where, fix))
