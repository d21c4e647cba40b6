"""The state folder keeps nothing that its catalogue does not know."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.manager.state_folders import (
    Folders,
    let_pass,
    make_private,
    remove,
    remove_temporary,
    sweep,
)

NOTE = "installed/known.json"


def state(step: Step) -> HostState:
    payload = PayloadRecord(
        key="known",
        digest="d",
        payload_id="org.example.known",
        version="1",
        release=1,
        fleet="",
        step=step,
        sources={},
        phases={},
        components=("eye",),
    )
    return HostState("spot", payloads={"known": payload})


def fill(folders: Folders) -> None:
    for key in ("known", "orphan"):
        for folder in folders.of(key):
            folder.mkdir(parents=True)
            (folder / "file").touch()
        folders.scratch(key, "eye").mkdir(parents=True, exist_ok=True)


@pytest.mark.parametrize(
    ("step", "kept"),
    [
        (Step.STORED, {"payloads/known", NOTE, "venvs/known", "scratch/known"}),
        (Step.QUARANTINED, {"payloads/known", NOTE}),
        (Step.REFUSED, set()),
        (Step.REMOVING, set()),
    ],
    ids=lambda value: value.name if isinstance(value, Step) else "",
)
def test_sweep_keeps_what_a_step_needs(tmp_path: Path, step: Step, kept: set[str]) -> None:
    folders = Folders(tmp_path)
    fill(folders)
    sweep(folders, state(step))
    left = {path.relative_to(tmp_path).as_posix() for path in tmp_path.glob("*/*")}
    assert left == kept


def test_temporary_files_of_a_daemon_that_was_killed_are_removed(tmp_path: Path) -> None:
    folders = Folders(tmp_path)
    for left in (folders.planning / "no-more", folders.probes / "nondum-probe-1" / "payload"):
        left.mkdir(parents=True, mode=0)
    remove_temporary(folders)
    assert not list(tmp_path.iterdir())


def modes(folder: Path) -> dict[str, int]:
    every = (folder, *folder.iterdir())
    return {p.relative_to(folder).as_posix(): stat.S_IMODE(p.lstat().st_mode) for p in every}


def test_state_folder_that_an_older_version_left_open_is_closed(tmp_path: Path) -> None:
    tmp_path.chmod(0o755)
    for name in ("venvs", "scratch", "store"):
        (tmp_path / name).mkdir(mode=0o755)
    for name in ("catalogue.sqlite", "catalogue.sqlite-wal", "deaths"):
        (tmp_path / name).touch(mode=0o644)
    (tmp_path / "slots").symlink_to("/nowhere")
    make_private(Folders(tmp_path))
    found = modes(tmp_path)
    del found["slots"]
    assert found == {
        **dict.fromkeys((".", "venvs", "scratch", "store"), 0o700),
        **dict.fromkeys(("catalogue.sqlite", "catalogue.sqlite-wal", "deaths"), 0o600),
    }


def test_workers_that_are_other_users_pass_to_their_own(tmp_path: Path) -> None:
    folders = Folders(tmp_path)
    (tmp_path / "store").mkdir()
    make_private(folders)
    let_pass(folders)
    assert modes(tmp_path) == {".": 0o711, "venvs": 0o711, "scratch": 0o711, "store": 0o700}


def test_removal_goes_through_locked_folders_and_not_through_links(tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "precious").touch()
    folder = tmp_path / "folder"
    (folder / "inner").mkdir(parents=True)
    (folder / "inner/file").touch()
    (folder / "link").symlink_to(outside)
    (folder / "dangling").symlink_to(tmp_path / "nowhere")
    (folder / "inner").chmod(0)
    remove(folder)
    assert not folder.exists()
    assert (outside / "precious").exists()
    remove(folder)
