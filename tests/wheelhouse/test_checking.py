"""Stored files that are not as they were."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest

from nondum.wheelhouse import checking
from nondum.wheelhouse.unpacking import StoredFile

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
