"""Bytes of a file are those of its positions, however they are asked for."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.wheelhouse.format.fixed_file import PIECE, FixedFile, pieces

DATA = bytes(range(256)) * 8
positions = st.none() | st.integers(-3000, 3000)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fixed") / "file"
    path.write_bytes(DATA)
    return path


@given(start=positions, stop=positions)
def test_slices_are_those_of_the_bytes(path: Path, start: int | None, stop: int | None) -> None:
    with FixedFile(path) as file:
        assert len(file) == len(DATA)
        assert file[start:stop] == DATA[start:stop]


def test_an_empty_file_has_no_bytes(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with FixedFile(tmp_path / "file") as file:
        assert (len(file), file[:10]) == (0, b"")


def test_a_buffer_is_filled_as_far_as_there_are_bytes(path: Path) -> None:
    with FixedFile(path) as file:
        buffer = memoryview(bytearray(100))
        assert file.read_into(buffer, len(DATA) - 30) == 30
        assert buffer[:30] == DATA[-30:]
        assert file.read_into(buffer, len(DATA)) == 0


def test_a_file_that_has_become_shorter_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(DATA)
    with FixedFile(path) as file:
        os.truncate(path, 100)
        assert file[50:100] == DATA[50:100]
        with pytest.raises(OSError, match="shorter") as raised:
            file[50:200]
    assert (raised.value.errno, raised.value.filename) == (errno.EIO, str(path))


def test_pieces_are_the_bytes_between_two_positions() -> None:
    data = bytes(3 * PIECE + 5)
    found = list(pieces(memoryview(data), 2, len(data) - 1))
    assert [len(piece) for piece in found] == [PIECE, PIECE, PIECE, 2]
