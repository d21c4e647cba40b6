"""The records of a zip file, walked from front to back as a reader without its directory would.

Readers differ in which record they believe, so all of them must say the same, follow one another
without a gap, and be plain: no comments, no second names, no parts on other disks. Specified in
PKWARE's APPNOTE (4.3 and 4.5); PyPI has refused most of the same since 2025.
"""

from __future__ import annotations

import itertools
import struct
import zipfile
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from nondum.wheelhouse.format.fixed_file import Bytes

MAX_DIRECTORY = 8 * 1024**2
"""Bytes of a directory: more are not read, since each entry takes ten times its bytes."""
LOCAL = struct.Struct("<4s5H3L2H")
_CENTRAL = struct.Struct("<4s6H3L5H2L")
_END = struct.Struct("<4s4H2LH")
_END64 = struct.Struct("<4sQ2H2L4Q")
_LOCATOR = struct.Struct("<4sLQL")

_LOCAL_MARK, _CENTRAL_MARK, _END_MARK = b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06"
_END64_MARK, _LOCATOR_MARK, _DESCRIPTOR_MARK = b"PK\x06\x06", b"PK\x06\x07", b"PK\x07\x08"
_ELSEWHERE, _ELSEWHERE_SHORT = 0xFFFFFFFF, 0xFFFF
"""In a value's place: the true one is in an extra field, or in the end record of zip64."""
_ENCRYPTED, _TOLD_LATER, _UTF8 = 0x1, 0x8, 0x800
_FLAGS = _ENCRYPTED | _TOLD_LATER | _UTF8 | 0x6
"""Those that are known here; 0x6 tells how hard deflate tried."""
_LONGEST_DESCRIPTOR = 24
_ZIP64 = 0x0001
_USUAL_HEADER = LOCAL.size + 226
"""Bytes that most headers are no longer than, name and extra fields included: read at once."""
_OTHER_NAMES = {0x7075: "another name", 0x6375: "another comment", 0x9901: "an encryption"}


class _Central(NamedTuple):
    """A member's entry in the directory, as it stands there."""

    name: bytes
    flags: int
    method: int
    crc: int
    sizes: tuple[int, int, int]
    """Unpacked, packed, offset; any may be told elsewhere."""
    disk: int
    extra: bytes
    comment: bytes


class _Local(NamedTuple):
    """A member's own header."""

    name: bytes
    flags: int
    method: int
    crc: int
    sizes: tuple[int, int]
    """Unpacked and packed; both may be told elsewhere, or later."""
    extra: bytes
    start: int
    """Where its packed bytes begin."""


class _End(NamedTuple):
    """What the end of the file tells of the directory."""

    disk: int
    directory_disk: int
    disk_members: int
    members: int
    size: int
    offset: int


def end_flaws(data: Bytes) -> Iterator[str]:
    """What is wrong with the file's end; nothing else of it may be read when anything is."""
    at = len(data) - _END.size
    if at < 0 or bytes(data[at : at + 4]) != _END_MARK:
        yield "does not end as a zip file does, or bytes follow its end"
        return
    if _END.unpack(data[at:])[-1]:
        yield "has a comment"
    end, at = _end(data, at)
    if end is None:
        yield "has two end records that do not agree"
        return
    if (end.disk, end.directory_disk) != (0, 0):
        yield "says that a part of it is on another disk"
    if end.disk_members != end.members:
        yield f"ends with {end.disk_members} and with {end.members} members"
    if end.size > MAX_DIRECTORY:
        yield f"has a directory longer than {MAX_DIRECTORY} bytes"
    if end.offset + end.size != at:
        yield "has its directory elsewhere than its end says"


def _end(data: Bytes, at: int) -> tuple[_End | None, int]:
    """What the end record at `at` tells, or the one of zip64 before it, and where that begins;
    None when they do not agree."""
    _, *told, _ = _END.unpack(data[at:])
    end = _End(*told)
    before = max(0, at - _LOCATOR.size)
    if bytes(data[before : before + 4]) != _LOCATOR_MARK:
        is_elsewhere = _ELSEWHERE in end or _ELSEWHERE_SHORT in (end.disk, end.members)
        return None if is_elsewhere else end, at
    at -= _LOCATOR.size + _END64.size
    if at < 0:
        return None, at
    records = data[at : at + _END64.size + _LOCATOR.size]
    mark, length, _, _, *rest = _END64.unpack_from(records)
    located = _LOCATOR.unpack_from(records, _END64.size)
    is_plain = (mark, length) == (_END64_MARK, _END64.size - 12)
    if not is_plain or located[1:] != (0, at, 1):
        return None, at
    agree = all(_agrees(*pair) for pair in zip(end, rest, strict=True))
    return _End(*rest) if agree else None, at


def _agrees(short: int, true: int) -> bool:
    return short in (true, _ELSEWHERE, _ELSEWHERE_SHORT)


def flaws(data: Bytes, listed: Sequence[zipfile.ZipInfo], directory: int) -> Iterator[str]:
    """Where the members' own headers and the directory, which begins at `directory`, say other
    than what `zipfile` has read, or leave bytes between them."""
    try:
        entries, end = _directory(data, directory, len(listed))
    except (struct.error, ValueError):
        yield "has its directory elsewhere than its end says"
        return
    told, _ = _end(data, len(data) - _END.size)
    if told is None or told.members != len(listed):
        yield f"has {len(listed)} members, and its end tells of another number"
    if bytes(data[end : end + 4]) not in (_END_MARK, _END64_MARK):
        yield "has bytes after its directory"
    position = 0
    pairs = sorted(zip(listed, entries, strict=True), key=lambda pair: pair[0].header_offset)
    for info, entry in pairs:
        if info.header_offset > position:
            yield _stray(info.header_offset - position, position)
        found = list(_member_flaws(data, info, entry))
        yield from (f"{info.filename!r} {flaw}" for flaw in found)
        if found:
            return
        position = max(position, span(data, info)[1] + len(_descriptor(data, info)))
    if position < directory:
        yield _stray(directory - position, position)


def _stray(count: int, at: int) -> str:
    return f"has {count} bytes at {at} that belong to no member"


def span(data: Bytes, info: zipfile.ZipInfo) -> tuple[int, int]:
    """Where a member's packed bytes begin and end."""
    start = _local(data, info.header_offset).start
    return start, start + info.compress_size


def _directory(data: Bytes, at: int, count: int) -> tuple[list[_Central], int]:
    """The entries of the directory, and where it ends. Raises `ValueError`, `struct.error`."""
    read = bytes(data[at : at + MAX_DIRECTORY])
    entries, begin, at = [], at, 0
    for _ in range(count):
        mark, _, _, flags, method, _, _, crc, packed, size, *rest = _CENTRAL.unpack_from(read, at)
        name_length, extra_length, comment_length, disk, _, _, offset = rest
        if mark != _CENTRAL_MARK:
            raise ValueError("no entry")
        at += _CENTRAL.size
        name, extra, comment, at = _three(read, at, name_length, extra_length, comment_length)
        sizes = (size, packed, offset)
        entries.append(_Central(name, flags, method, crc, sizes, disk, extra, comment))
    return entries, begin + at


def _local(data: Bytes, at: int) -> _Local:
    """A member's own header. Raises `ValueError`, `struct.error`."""
    read = bytes(data[at : at + _USUAL_HEADER])
    mark, _, flags, method, _, _, crc, packed, size, *lengths = LOCAL.unpack_from(read)
    if mark != _LOCAL_MARK:
        raise ValueError("no header")
    length = LOCAL.size + sum(lengths)
    if length > len(read):
        read = bytes(data[at : at + length])
    name, extra, _, _ = _three(read, LOCAL.size, *lengths, 0)
    return _Local(name, flags, method, crc, (size, packed), extra, at + length)


def _three(data: bytes, at: int, *lengths: int) -> tuple[bytes, bytes, bytes, int]:
    """Three runs of bytes and where they end."""
    ends = [at]
    for length in lengths:
        ends.append(ends[-1] + length)
    first, second, third = (data[a:b] for a, b in itertools.pairwise(ends))
    return first, second, third, ends[-1]


def _member_flaws(data: Bytes, info: zipfile.ZipInfo, entry: _Central) -> Iterator[str]:
    try:
        local = _local(data, info.header_offset)
    except (struct.error, ValueError):
        yield "has no local header where the directory says"
        return
    if local.start + info.compress_size > len(data):
        yield "lies outside the file"
        return
    yield from _entry_flaws(entry)
    if local.name != entry.name:
        yield "has another name in its own header"
    if (local.flags, local.method) != (entry.flags, entry.method):
        yield "is packed in another way by its own header"
    yield from _extra_flaws(local.extra)
    if not _sizes_agree(local, info):
        yield "has another size or checksum in its own header"
    if _zip64(entry.extra) != _directory_zip64(entry, info):
        yield "has another size or place in an extra field"
    if entry.flags & _TOLD_LATER and not _descriptor(data, info):
        yield "has another size or checksum after its bytes"


def _entry_flaws(entry: _Central) -> Iterator[str]:
    if entry.flags & _ENCRYPTED:
        yield "is encrypted"
    elif entry.flags & ~_FLAGS:
        yield "has flags that are not known here"
    if entry.method not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        yield "is packed by another method than deflate"
    if entry.disk not in (0, _ELSEWHERE_SHORT):
        yield "is said to be on another disk"
    if entry.comment:
        yield "has a comment"
    if not entry.name.isascii() and not entry.flags & _UTF8:
        yield "has a name in no known encoding"
    yield from _extra_flaws(entry.extra)


def _extra_flaws(extra: bytes) -> Iterator[str]:
    fields = _fields(extra)
    if fields is None:
        yield "has extra fields that are cut off"
        return
    kinds = [kind for kind, _ in fields]
    if kinds.count(_ZIP64) > 1:
        yield "has its sizes in two extra fields"
    for kind in sorted(_OTHER_NAMES.keys() & set(kinds)):
        yield f"has {_OTHER_NAMES[kind]} in an extra field"


def _fields(extra: bytes) -> list[tuple[int, bytes]] | None:
    """The extra fields by kind, or None when they do not fill their place."""
    fields, at = [], 0
    while at < len(extra):
        if at + 4 > len(extra):
            return None
        kind, length = struct.unpack_from("<HH", extra, at)
        at += 4 + length
        fields.append((kind, extra[at - length : at]))
    return fields if at == len(extra) else None


def _zip64(extra: bytes) -> bytes:
    return next((body for kind, body in _fields(extra) or () if kind == _ZIP64), b"")


def _directory_zip64(entry: _Central, info: zipfile.ZipInfo) -> bytes:
    """What the extra field must hold: each value that is not in its place, in this order."""
    true = (info.file_size, info.compress_size, info.header_offset)
    pairs = zip(entry.sizes, true, strict=True)
    return b"".join(struct.pack("<Q", size) for told, size in pairs if told == _ELSEWHERE)


def _sizes_agree(local: _Local, info: zipfile.ZipInfo) -> bool:
    true = (info.file_size, info.compress_size)
    zip64, is_told_later = _zip64(local.extra), bool(local.flags & _TOLD_LATER)
    allowed = [struct.pack("<QQ", *true)] + ([bytes(16)] if is_told_later else [])
    if zip64 and zip64 not in allowed:
        return False
    unknown = {0} if is_told_later else set()
    elsewhere = {_ELSEWHERE} if zip64 else set()
    sizes = zip(local.sizes, true, strict=True)
    return local.crc in {info.CRC} | unknown and all(
        told in {size} | unknown | elsewhere for told, size in sizes
    )


def _descriptor(data: Bytes, info: zipfile.ZipInfo) -> bytes:
    """The data descriptor that follows a member's bytes; empty when none does, or it lies."""
    if not info.flag_bits & _TOLD_LATER:
        return b""
    end = span(data, info)[1]
    read = bytes(data[end : end + _LONGEST_DESCRIPTOR])
    for mark in (_DESCRIPTOR_MARK, b""):
        for form in ("<LQQ", "<LLL"):
            if form == "<LLL" and max(info.compress_size, info.file_size) > _ELSEWHERE:
                continue
            sizes = struct.pack(form, info.CRC, info.compress_size, info.file_size)
            if read.startswith(mark + sizes):
                return mark + sizes
    return b""
