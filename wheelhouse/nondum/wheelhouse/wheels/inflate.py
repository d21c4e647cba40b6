"""Inflating (RFC 1951): by ISA-L where python-isal is installed, twice as fast, else by zlib.

Either way the bytes are the same, and what is read is bounded piece by piece.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from typing import Any

_PIECE = 1024 * 1024
"""Most unpacked bytes taken at once."""
HEAD_FEED = 4096
"""Packed bytes that are enough for the first few: what describes a block takes some hundred."""


def _library() -> Any:
    try:
        from isal import isal_zlib
    except ImportError:
        return zlib
    return isal_zlib


_LIBRARY: Any = _library()
crc32 = _LIBRARY.crc32
"""crc32(data, value=0) of ISO 3309, as zlib has it."""


def inflated(packed: Iterable[bytes | memoryview], library: Any = _LIBRARY) -> Iterator[bytes]:
    """Unpack raw deflated bytes piece by piece. Raises `ValueError` unless all of them were one
    whole stream.

    They are given in pieces, too: what is not taken of one is copied every time.
    """
    inflate = library.decompressobj(-zlib.MAX_WBITS)
    try:
        for fed in packed:
            if inflate.eof:
                raise ValueError("bytes follow the packed ones")
            yield from _taken(inflate, fed)
    except (library.error, zlib.error) as error:
        raise ValueError(str(error)) from error
    if not inflate.eof or inflate.unused_data:
        raise ValueError("the packed bytes do not end where the directory says")


def beginning(packed: bytes | memoryview, count: int, library: Any = _LIBRARY) -> bytes:
    """The first of some raw deflated bytes, of which `HEAD_FEED` are enough; fewer where there are
    no more, or they are damaged."""
    inflate = library.decompressobj(-zlib.MAX_WBITS)
    try:
        found: bytes = inflate.decompress(packed[:HEAD_FEED], count)
    except (library.error, zlib.error):
        return b""
    return found


def _taken(inflate: Any, fed: Any) -> Iterator[bytes]:
    """All that comes of some packed bytes."""
    piece = inflate.decompress(fed, _PIECE)
    while piece:
        yield piece
        if inflate.eof:
            return
        piece = inflate.decompress(inflate.unconsumed_tail, _PIECE)
