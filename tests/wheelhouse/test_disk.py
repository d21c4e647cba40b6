"""What is written is safe, and what the disk says is told with what to do about it."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from nondum.wheelhouse.store import disk


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (errno.ENOSPC, "DISK_FULL"),
        (errno.EDQUOT, "DISK_FULL"),
        (errno.EIO, "IO_ERROR"),
        (errno.EROFS, "IO_ERROR"),
        (errno.EACCES, "IO_ERROR"),
        (errno.EMFILE, "NO_RESOURCES"),
        (errno.ENFILE, "NO_RESOURCES"),
        (errno.ENOMEM, "NO_RESOURCES"),
    ],
    ids=errno.errorcode.get,
)
def test_error_of_the_system_has_a_code_and_a_way_out(tmp_path: Path, code: int, told: str) -> None:
    problem = disk.problem_of(OSError(code, os.strerror(code)), "x", tmp_path / "not/there")
    assert problem.code == told
    assert problem.fix
    assert bool(problem.have) == (told == "DISK_FULL")


def test_content_is_the_old_one_or_the_new_one(tmp_path: Path) -> None:
    file = tmp_path / "file"
    disk.write(file, b"old")
    (tmp_path / ".file.part").write_bytes(b"of a daemon that was killed")
    disk.write(file, b"new")
    assert file.read_bytes() == b"new"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_folders_are_made_as_deep_as_they_are_wanted(tmp_path: Path) -> None:
    disk.make_folder(tmp_path / "a/b/c")
    disk.make_folder(tmp_path / "a/b/c")
    assert (tmp_path / "a/b/c").is_dir()
    (tmp_path / "file").touch()
    with pytest.raises(FileExistsError):
        disk.make_folder(tmp_path / "file")


def test_two_folders_change_places_at_one_stroke(tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
    assert disk.exchange(tmp_path / "one", tmp_path / "other")
    assert (tmp_path / "one/file").read_text() == "other"
    assert (tmp_path / "other/file").read_text() == "one"


def test_what_is_not_there_changes_no_places(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    assert not disk.exchange(tmp_path / "one", tmp_path / "other")
    assert (tmp_path / "one").is_dir()
