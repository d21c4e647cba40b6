"""A wheel as a zip file, judged by its bytes before anything in it is unpacked.

Two readers of one file must see the same thing: what Python's zipfile, pip and this module could
disagree about is refused (PyPI refuses the same since 2025). Offsets are into the file's bytes.
"""

from __future__ import annotations

import io
import itertools
import re
import stat
import struct
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from nondum.sdk.errors import Problem
from nondum.wheelhouse.inflate import crc32, inflated

Bytes = memoryview
MAX_MEMBERS = 20_000
MAX_TOTAL_BYTES = 2 * 1024**3
MAX_RATIO = 1000
RATIO_COUNTS_ABOVE = 1024**2
MAX_NAME = 255

_END = b"PK\x05\x06"
_END_LENGTH = 22
_LOCAL = struct.Struct("<4s5H3L2H")
_ZIP64 = 0xFFFFFFFF
"""In a size's place: the true size is in an extra field."""
_DESCRIPTOR_MAX = 24
"""Longest data descriptor that may follow a member; no header fits in it."""
_CHUNK = 1024 * 1024
_CONTROL = re.compile(r"[\x00-\x1f]")


@dataclass(frozen=True, slots=True)
class Member:
    """A file in the archive."""

    path: str
    size: int
    """Unpacked, in bytes."""
    is_packed: bool
    """Deflated rather than stored."""
    start: int
    """Where its bytes begin."""
    end: int
    crc: int
    is_executable: bool


@dataclass(frozen=True, slots=True)
class Archive:
    """What a zip file holds, and what is wrong with it."""

    members: tuple[Member, ...]
    problems: tuple[Problem, ...]


def read(data: Bytes, where: str) -> Archive:
    """List the members of an archive, and everything that makes it unsafe to unpack."""
    try:
        found = zipfile.ZipFile(io.BufferedReader(_View(data)))
    except (zipfile.BadZipFile, NotImplementedError, OSError, ValueError, struct.error) as error:
        return Archive((), (Problem("WHEEL_STRUCTURE", f"is no zip file ({error})", where=where),))
    listed, flaws = found.infolist(), _outline_flaws(data, found)
    problems = [
        *(Problem("WHEEL_STRUCTURE", text, where=where) for text in flaws),
        *(Problem("WHEEL_BOMB", text, where=where) for text in _bomb_flaws(listed)),
        *_path_problems(listed, where),
    ]
    if problems:
        return Archive((), tuple(problems))
    members = tuple(_member(data, info) for info in listed if not info.is_dir())
    overlaps = tuple(
        Problem("WHEEL_BOMB", f"{text} overlap", where=where) for text in _overlaps(members)
    )
    return Archive(members, overlaps)


def unpack(data: Bytes, member: Member) -> Iterator[bytes]:
    """The member's bytes in pieces. Raises `ValueError` when they are not whole."""
    raw = data[member.start : member.end]
    yield from _checked(inflated(raw) if member.is_packed else _cut(raw), member)


def _cut(raw: Bytes) -> Iterator[bytes]:
    for start in range(0, len(raw), _CHUNK):
        yield bytes(raw[start : start + _CHUNK])


def _checked(pieces: Iterator[bytes], member: Member) -> Iterator[bytes]:
    size, crc = 0, 0
    for piece in pieces:
        size += len(piece)
        crc = crc32(piece, crc)
        if size > member.size:
            break
        yield piece
    if size != member.size or crc != member.crc:
        raise ValueError("size or checksum is not what the directory says")


def _member(data: Bytes, info: zipfile.ZipInfo) -> Member:
    start, end = _span(data, info)
    return Member(
        path=info.filename,
        size=info.file_size,
        is_packed=info.compress_type == zipfile.ZIP_DEFLATED,
        start=start,
        end=end,
        crc=info.CRC,
        is_executable=bool(info.external_attr >> 16 & stat.S_IXUSR),
    )


def _outline_flaws(data: Bytes, archive: zipfile.ZipFile) -> Iterator[str]:
    listed = archive.infolist()
    if len(data) < _END_LENGTH or bytes(data[-_END_LENGTH:][:4]) != _END:
        yield "bytes follow the end of the archive"
    if listed and min(info.header_offset for info in listed) != 0:
        yield "bytes precede the archive"
    names = Counter(info.filename for info in listed)
    for name in sorted(name for name, count in names.items() if count > 1)[:3]:
        yield f"{name!r} stands twice"
    flaws = [flaw for info in listed for flaw in _entry_flaws(data, info)]
    yield from flaws or _hidden(data, listed, archive.start_dir)


def _hidden(data: Bytes, listed: list[zipfile.ZipInfo], directory: int) -> Iterator[str]:
    """Bytes between members that only a reader from front to back would see as members."""
    starts = sorted([*(info.header_offset for info in listed), directory])
    ends = sorted(_span(data, info)[1] for info in listed)
    for end, start in zip(ends, starts[1:], strict=True):
        if start - end > _DESCRIPTOR_MAX:
            yield f"{start - end} bytes at {end} belong to no member"


def _span(data: Bytes, info: zipfile.ZipInfo) -> tuple[int, int]:
    """Where a member's packed bytes begin and end."""
    local = _LOCAL.unpack_from(data, info.header_offset)
    start = info.header_offset + _LOCAL.size + local[9] + local[10]
    return start, start + info.compress_size


def _entry_flaws(data: Bytes, info: zipfile.ZipInfo) -> Iterator[str]:
    if info.flag_bits & 0x1:
        yield f"{info.filename!r} is encrypted"
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        yield f"{info.filename!r} is packed by another method than deflate"
    try:
        local = _LOCAL.unpack_from(data, info.header_offset)
    except struct.error:
        yield f"{info.filename!r} lies outside the file"
        return
    start = info.header_offset + _LOCAL.size
    name = bytes(data[start : start + local[9]])
    if local[0] != b"PK\x03\x04" or name != info.orig_filename.encode(
        "utf-8" if info.flag_bits & 0x800 else "cp437"
    ):
        yield f"{info.filename!r} has another name in its own header"
    is_told_later = info.flag_bits & 0x8 or _ZIP64 in local[7:9]
    if not is_told_later and local[6:9] != (info.CRC, info.compress_size, info.file_size):
        yield f"{info.filename!r} has another size or checksum in its own header"
    if start + local[9] + local[10] + info.compress_size > len(data):
        yield f"{info.filename!r} lies outside the file"


def _bomb_flaws(listed: list[zipfile.ZipInfo]) -> Iterator[str]:
    if len(listed) > MAX_MEMBERS:
        yield f"has {len(listed)} members, more than {MAX_MEMBERS}"
    total = sum(info.file_size for info in listed)
    if total > MAX_TOTAL_BYTES:
        yield f"unpacks to {total} bytes, more than {MAX_TOTAL_BYTES}"
    for info in listed:
        grows = info.file_size > MAX_RATIO * max(info.compress_size, 1)
        if info.file_size > RATIO_COUNTS_ABOVE and grows:
            yield f"{info.filename!r} unpacks to more than {MAX_RATIO} times its size"


def _overlaps(members: tuple[Member, ...]) -> Iterator[str]:
    ordered = sorted(members, key=lambda member: (member.start, member.end))
    for one, other in itertools.pairwise(ordered):
        if other.start < one.end:
            yield f"{one.path!r} and {other.path!r}"


def _path_problems(listed: list[zipfile.ZipInfo], where: str) -> Iterator[Problem]:
    folded: dict[str, str] = {}
    for info in listed:
        if flaw := _path_flaw(info):
            text = f"member {info.filename[:80]!r} {flaw}"
            yield Problem("WHEEL_PATH", text, where=where)
        other = folded.setdefault(info.filename.lower(), info.filename)
        if other != info.filename:
            text = f"{info.filename!r} and {other!r} are one file on some systems"
            yield Problem("WHEEL_PATH", text, where=where)


def _path_flaw(info: zipfile.ZipInfo) -> str | None:
    path = info.filename
    parts = path.rstrip("/").split("/")
    if path.startswith("/") or ".." in parts:
        return "leaves the wheel"
    if "\\" in info.orig_filename or ":" in path or _CONTROL.search(info.orig_filename):
        return "has characters that paths may not have"
    if "" in parts or "." in parts:
        return "is not in its shortest form"
    if any(len(part.encode()) > MAX_NAME for part in parts):
        return f"has a part longer than {MAX_NAME} bytes"
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is no regular file"
    return None


class _View(io.RawIOBase):
    """A memoryview as a raw file, without copying it."""

    def __init__(self, data: Bytes) -> None:
        self._data = data
        self._position = 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._position, io.SEEK_END: len(self._data)}[whence]
        if base + offset < 0:
            raise OSError("seek before the start")
        self._position = base + offset
        return self._position

    def tell(self) -> int:
        return self._position

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]  # any writable buffer
        piece = self._data[self._position : self._position + len(buffer)]
        buffer[: len(piece)] = piece
        self._position += len(piece)
        return len(piece)
