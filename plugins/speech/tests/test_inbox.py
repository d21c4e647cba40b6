"""Files in the inbox: each is heard once, whosever it is."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from nondum_speech.inbox import Inbox


@pytest.fixture
def inbox(tmp_path: Path) -> Inbox:
    return Inbox(tmp_path / "in")


@pytest.fixture
def fixed(inbox: Inbox) -> Iterator[Path]:
    """A file in it that cannot be renamed."""
    if os.geteuid() != 0:
        pytest.skip("mounting needs root")
    path = inbox.folder / "one.wav"
    path.write_bytes(b"RIFF")
    subprocess.run(["mount", "--bind", path, path], check=True)
    yield path
    subprocess.run(["umount", path], check=True)


def test_file_is_taken_once(inbox: Inbox) -> None:
    for _ in range(2):
        path = inbox.folder / "one.wav"
        path.write_bytes(b"RIFF")
        assert list(inbox.waiting()) == [path]
        inbox.take(path)
        assert [each.name for each in inbox.folder.iterdir()] == ["one.wav.heard"]


def test_file_that_cannot_be_renamed_is_taken_once(inbox: Inbox, fixed: Path) -> None:
    inbox.take(fixed)
    assert not list(Inbox(inbox.folder).waiting())


def test_another_file_of_that_name_is_taken_too(inbox: Inbox, fixed: Path) -> None:
    inbox.take(fixed)
    fixed.write_bytes(b"RIFF and more")
    assert list(inbox.waiting()) == [fixed]


def test_file_that_cannot_be_marked_is_not_taken(inbox: Inbox, tmp_path: Path) -> None:
    path = inbox.folder / "one.wav"
    path.write_bytes(b"RIFF")
    (inbox.folder / "one.wav.heard").mkdir()
    with pytest.raises(IsADirectoryError):
        inbox.take(path)
    assert list(inbox.waiting()) == [path]
    inbox.give_up(path)
    assert not list(inbox.waiting())
    path.write_bytes(b"RIFF and more")
    assert list(inbox.waiting()) == [path]
