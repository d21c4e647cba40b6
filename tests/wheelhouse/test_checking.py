"""Stored files that are not as they were."""

from __future__ import annotations

import errno
import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.kit.descriptors import descriptors_left

from nondum.wheelhouse.store import checking
from nondum.wheelhouse.store.unpacking import StoredFile

DATA = b"d" * 300_000


def stored(folder: Path, name: str, data: bytes) -> StoredFile:
    (folder / name).write_bytes(data)
    return StoredFile(name, len(data), hashlib.sha256(data).hexdigest())


@pytest.mark.parametrize("data", [b"", b"x", DATA], ids=["empty", "small", "large"])
@pytest.mark.parametrize(
    "harm",
    [
        pytest.param(lambda path, data: path.write_bytes(data + b"x"), id="grown"),
        pytest.param(lambda path, data: path.unlink(), id="gone"),
        pytest.param(lambda path, data: (path.unlink(), path.mkdir()), id="a folder"),
        pytest.param(
            lambda path, data: (
                path.rename(f"{path}.moved"),
                path.symlink_to(f"{path}.moved"),
            ),
            id="a link",
        ),
    ],
)
def test_any_harm_is_found(
    tmp_path: Path, data: bytes, harm: Callable[[Path, bytes], object]
) -> None:
    file, other = stored(tmp_path, "a", data), stored(tmp_path, "b", data)
    assert checking.damaged(tmp_path, (file, other)) == ()
    harm(tmp_path / "a", data)
    assert checking.damaged(tmp_path, (file, other)) == (file,)


@pytest.mark.parametrize("data", [b"x", DATA], ids=["small", "large"])
def test_one_other_byte_is_found(tmp_path: Path, data: bytes) -> None:
    file = stored(tmp_path, "a", data)
    (tmp_path / "a").write_bytes(data[:-1] + b"y")
    assert checking.damaged(tmp_path, (file,)) == (file,)


@pytest.mark.parametrize("size", [300_000, 600_000], ids=["two pieces", "three pieces"])
def test_progress_that_cannot_be_reported_is_no_damage(tmp_path: Path, size: int) -> None:
    """A job's daemon may be killed while the job reads: the pipe to it is broken then."""
    files = [stored(tmp_path, name, b"d" * size) for name in ("a", "b")]

    def broken() -> None:
        raise BrokenPipeError

    with pytest.raises(BrokenPipeError):
        checking.damaged(tmp_path, files, broken)


@pytest.mark.parametrize("data", [b"x", DATA], ids=["small", "large"])
def test_want_of_descriptors_is_no_damage(tmp_path: Path, data: bytes) -> None:
    file = stored(tmp_path, "a", data)
    with descriptors_left(0), pytest.raises(OSError) as raised:
        checking.damaged(tmp_path, (file,))
    assert raised.value.errno == errno.EMFILE
