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
import unicodedata
import zipfile
from collections import Counter
from collections.abc import Iterator

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.contents import MAX_FILE_BYTES
from nondum.wheelhouse.format.fixed_file import Bytes, pieces
from nondum.wheelhouse.wheels import outline
from nondum.wheelhouse.wheels.inflate import HEAD_FEED, beginning, crc32, inflated

MAX_MEMBERS = 20_000
MAX_TOTAL_BYTES = MAX_FILE_BYTES
MAX_RATIO = 1000
"""How many times its packed size a member may unpack to; deflate can do no more than 1032."""
MAX_WHOLE_RATIO = 100
"""How many times its own size a wheel may unpack to: of 430 widely used ones, none reaches 11."""
RATIO_COUNTS_ABOVE = 16 * 1024**2
"""Bytes: test data of a few megabytes of zeros is in honest wheels."""
MAX_NAME = 255
MAX_PATH = 1000
"""Bytes of a whole path: it is laid below folders of the store, and Linux takes 4096."""
MAX_DEPTH = 64

_RESERVED = re.compile(r"(con|prn|aux|nul|(com|lpt)[0-9¹²³])(\..*)?", re.IGNORECASE)
"""Names that are devices on Windows, whatever follows a dot."""


@frozen
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


@frozen
class Archive:
    """What a zip file holds, and what is wrong with it."""

    members: tuple[Member, ...]
    problems: tuple[Problem, ...]


def read(data: Bytes, where: str) -> Archive:
    """List the members of an archive, and everything that makes it unsafe to unpack."""
    if flaws := list(outline.end_flaws(data)):
        return Archive((), tuple(Problem("WHEEL_STRUCTURE", text, where=where) for text in flaws))
    try:
        found = zipfile.ZipFile(io.BufferedReader(_View(data)))
    except (zipfile.BadZipFile, NotImplementedError, OSError, ValueError, struct.error) as error:
        return Archive((), (Problem("WHEEL_STRUCTURE", f"is no zip file ({error})", where=where),))
    listed = found.infolist()
    if len(listed) > MAX_MEMBERS:
        text = f"has {len(listed)} members, more than {MAX_MEMBERS}"
        return Archive((), (Problem("WHEEL_BOMB", text, where=where),))
    problems = [
        *(Problem("WHEEL_STRUCTURE", text, where=where) for text in _outline_flaws(data, found)),
        *(Problem("WHEEL_BOMB", text, where=where) for text in _bomb_flaws(listed, len(data))),
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
    raw = pieces(data, member.start, member.end)
    yield from _checked(inflated(raw) if member.is_packed else map(bytes, raw), member)


def head(data: Bytes, member: Member, count: int) -> bytes:
    """The member's first bytes, fewer where it is shorter or damaged, without reading on."""
    enough = HEAD_FEED if member.is_packed else count
    raw = data[member.start : min(member.end, member.start + enough)]
    return beginning(raw, count) if member.is_packed else bytes(raw)


def contains(data: Bytes, member: Member, wanted: bytes) -> bool:
    """Whether some bytes are anywhere in a member; of a damaged one, in what comes before."""
    before = b""
    try:
        for piece in unpack(data, member):
            if wanted in before + piece:
                return True
            before = piece[-len(wanted) :]
    except ValueError:  # told where its contents are judged
        pass
    return False


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
    start, end = outline.span(data, info)
    return Member(
        path=info.filename,
        size=info.file_size,
        is_packed=info.compress_type == zipfile.ZIP_DEFLATED,
        start=start,
        end=end,
        crc=info.CRC,
        is_executable=bool(info.external_attr >> 16 & stat.S_IXUSR),
    )


def _outline_flaws(data: Bytes, found: zipfile.ZipFile) -> Iterator[str]:
    listed = found.infolist()
    names = Counter(info.filename for info in listed)
    for name in sorted(name for name, count in names.items() if count > 1)[:3]:
        yield f"{name!r} stands twice"
    yield from outline.flaws(data, listed, found.start_dir)


def _bomb_flaws(listed: list[zipfile.ZipInfo], packed: int) -> Iterator[str]:
    total = sum(info.file_size for info in listed)
    if total > MAX_TOTAL_BYTES:
        yield f"unpacks to {total} bytes, more than {MAX_TOTAL_BYTES}"
    elif total > max(RATIO_COUNTS_ABOVE, MAX_WHOLE_RATIO * packed):
        yield f"unpacks to more than {MAX_WHOLE_RATIO} times its size"
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
        if flaw := _path_flaw(info) or _kind_flaw(info):
            text = f"member {info.filename[:80]!r} {flaw}"
            yield Problem("WHEEL_PATH", text, where=where)
        other = folded.setdefault(_folded(info.filename), info.filename)
        if other != info.filename:
            text = f"{info.filename[:80]!r} and {other[:80]!r} are one file on some systems"
            yield Problem("WHEEL_PATH", text, where=where)


def _folded(path: str) -> str:
    """What a file system that folds cases and spellings takes a path for."""
    return path.lower() if path.isascii() else unicodedata.normalize("NFC", path).casefold()


def _path_flaw(info: zipfile.ZipInfo) -> str | None:
    path = info.filename
    parts = path.rstrip("/").split("/")
    if path.startswith("/") or ".." in parts:
        return "leaves the wheel"
    if "\\" in info.orig_filename or ":" in path or not _is_plain(info.orig_filename):
        return "has characters that paths may not have"
    if "" in parts or "." in parts:
        return "is not in its shortest form"
    if any(len(part.encode()) > MAX_NAME for part in parts):
        return f"has a part longer than {MAX_NAME} bytes"
    if len(path.encode()) > MAX_PATH or len(parts) > MAX_DEPTH:
        return f"is longer than {MAX_PATH} bytes, or deeper than {MAX_DEPTH} folders"
    if any(part[-1] in ". " or _RESERVED.fullmatch(part) for part in parts):
        return "has a name that some systems take for another"
    return None


def _is_plain(path: str) -> bool:
    """Whether nothing in a path hides or turns round what people read."""
    return path.isprintable() or not any(
        unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Zl", "Zp") for letter in path
    )


def _kind_flaw(info: zipfile.ZipInfo) -> str | None:
    kind = stat.S_IFMT(info.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is no regular file"
    if info.is_dir() and info.file_size:
        return "is a folder that has bytes"
    if kind == stat.S_IFDIR and not info.is_dir():
        return "is a folder by its mode, and a file by its name"
    return None


class _View(io.RawIOBase):
    """Bytes as a raw file, read where they are asked for."""

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
