"""The state folder keeps nothing that its catalogue does not know."""

from __future__ import annotations

from pathlib import Path

import pytest

from nondum.host.catalogue.records import PayloadRecord, Step
from nondum.host.catalogue.state import HostState
from nondum.host.lifecycle.folders import Folders, remove, sweep

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
