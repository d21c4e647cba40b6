"""Inflating by either library gives the same bytes, and refuses the same damage."""

from __future__ import annotations

import contextlib
import random
import zlib
from typing import Any

import isal.isal_zlib
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.wheelhouse.format.fixed_file import pieces
from nondum.wheelhouse.wheels.inflate import crc32, inflated

MEGABYTE = 1024 * 1024
either_library = pytest.mark.parametrize(
    "library", [zlib, isal.isal_zlib], ids=["zlib", "python-isal"]
)


def deflated(data: bytes, level: int = 6) -> bytes:
    deflate = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS)
    return deflate.compress(data) + deflate.flush()


def whole(packed: bytes, library: Any) -> bytes:
    return b"".join(inflated(pieces(memoryview(packed), 0, len(packed)), library))


@either_library
@pytest.mark.parametrize("level", [0, 1, 9])
@pytest.mark.parametrize("size", [0, 1, MEGABYTE - 1, MEGABYTE, MEGABYTE + 1, 3 * MEGABYTE])
def test_whole_streams_come_back(library: Any, size: int, level: int) -> None:
    for data in (bytes(size), random.Random(size).randbytes(size)):
        assert whole(deflated(data, level), library) == data


@either_library
@given(data=st.binary(max_size=2000), level=st.integers(0, 9))
def test_any_bytes_come_back(library: Any, data: bytes, level: int) -> None:
    assert whole(deflated(data, level), library) == data


@either_library
@pytest.mark.parametrize("tail", [b"x", bytes(MEGABYTE)], ids=["byte", "megabyte"])
def test_bytes_behind_the_stream_are_refused(library: Any, tail: bytes) -> None:
    for data in (b"", b"some", bytes(3 * MEGABYTE)):
        with pytest.raises(ValueError, match=r"bytes"):
            whole(deflated(data) + tail, library)


@either_library
def test_no_more_is_fed_behind_the_stream(library: Any) -> None:
    packed = memoryview(deflated(b"some") + bytes(MEGABYTE))
    fed = list(pieces(packed, 0, len(packed)))
    left = iter(fed)
    with pytest.raises(ValueError, match=r"\bbytes\b"):
        list(inflated(left, library))
    assert len(fed) - len(list(left)) == 2, "the one in which it ends, and the one seen to be more"


@either_library
@given(data=st.binary(min_size=1, max_size=2000), cut=st.integers(1, 100))
def test_cut_streams_are_refused(library: Any, data: bytes, cut: int) -> None:
    packed = deflated(data)
    with pytest.raises(ValueError, match=r"."):
        whole(packed[: max(0, len(packed) - cut)], library)


@either_library
@given(noise=st.binary(max_size=300))
def test_noise_is_inflated_or_refused(library: Any, noise: bytes) -> None:
    with contextlib.suppress(ValueError):
        whole(noise, library)


def test_checksums_are_those_of_zip_files() -> None:
    assert crc32(b"123456789") == zlib.crc32(b"123456789") == 0xCBF43926
