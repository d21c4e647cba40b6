"""A payload is put on a drive whole, and in the place of another one at one stroke."""

from __future__ import annotations

import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from nondum.wheelhouse.build import build
from nondum.wheelhouse.store import disk

ID = "org.example.lamp"


def made(root: Path, release: int) -> Path:
    folder = root / f"made-{release}" / ID
    folder.mkdir(parents=True)
    (folder / "CONTENTS").write_text(f"release {release}")
    (folder / f"only-{release}").touch()
    return folder


def test_what_was_there_is_replaced_whole(tmp_path: Path) -> None:
    drive = tmp_path / "drive"
    for release in (1, 2):
        target = build.deliver(made(tmp_path, release), drive)
    assert target == drive / "nondum" / ID
    assert sorted(path.name for path in target.iterdir()) == ["CONTENTS", "only-2"]
    assert [path.name for path in target.parent.iterdir()] == [ID]


def test_what_a_build_that_was_killed_left_is_cleared_away(tmp_path: Path) -> None:
    left = tmp_path / "drive/nondum" / f".{ID}.part"
    left.mkdir(parents=True)
    (left / "half").touch()
    target = build.deliver(made(tmp_path, 1), tmp_path / "drive")
    assert sorted(path.name for path in target.iterdir()) == ["CONTENTS", "only-1"]
    assert not left.exists()


def test_the_payload_is_there_at_any_moment_of_a_replacement(tmp_path: Path) -> None:
    drive = tmp_path / "drive"
    contents = build.deliver(made(tmp_path, 0), drive) / "CONTENTS"
    missed, is_over = [], threading.Event()

    def look() -> None:
        while not is_over.is_set():
            if not contents.exists():
                missed.append(contents)

    looking = threading.Thread(target=look)
    looking.start()
    for release in range(1, 100):
        build.deliver(made(tmp_path, release), drive)
    is_over.set()
    looking.join()
    assert not missed
    assert contents.read_text() == "release 99"


def test_where_places_cannot_be_changed_it_is_replaced_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a system that knows of no exchange."""
    monkeypatch.setattr(disk, "_libc", SimpleNamespace(syncfs=lambda descriptor: 0))
    for release in (1, 2):
        target = build.deliver(made(tmp_path, release), tmp_path / "drive")
    assert sorted(path.name for path in target.iterdir()) == ["CONTENTS", "only-2"]
    assert [path.name for path in target.parent.iterdir()] == [ID]
