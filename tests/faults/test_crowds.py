"""Many drives at once wait for one another, and each comes to its end.

A hundred are `python -m tests.faults.drive_figures crowd`.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tests.faults.crowds import SOUND, make, plug_all
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import RunningHost, running

from nondum.host.manager.installation import AT_ONCE

pytestmark = pytest.mark.daemon

DRIVES = 8


def test_drives_in_a_crowd_wait_and_are_all_judged(tmp_path: Path) -> None:
    with running(tmp_path / "host") as host:
        crowd = plug_all(host, make(tmp_path / "drives", DRIVES), within_s=0.0)
        of_a_kind = DRIVES // 4
        assert crowd.active == of_a_kind + 1, "each sound one, and one for all copies"
        assert (crowd.refused, crowd.let_go) == (of_a_kind, of_a_kind)
        assert crowd.queued
        assert crowd.most_at_once <= AT_ONCE
        same = next(row for row in host.view["payloads"] if row["payload"] == "org.example.same")
        assert len(same["drive"].split(", ")) == of_a_kind


def test_payload_stays_until_its_last_drive_goes(tmp_path: Path) -> None:
    drives = [tmp_path / name for name in ("first", "second", "third")]
    whole = same(tmp_path)
    for drive in drives:
        shutil.copytree(whole, drive)
    with running(tmp_path / "host") as host:
        for drive in drives:
            host.plug(drive)
        host.until(
            "it is read from each of them",
            lambda view: any(
                len(row["drive"].split(", ")) == len(drives) for row in view["payloads"]
            ),
        )
        keys = {host.until_step("same", "active")["key"]}
        for drive in drives[:-1]:
            host.pull(drive.name)
            until_pulled(host, drive.name)
            keys.add(host.until_step("same", "active")["key"])
        assert len(keys) == 1
        host.pull(drives[-1].name)
        host.until_gone("same")
        assert [row["event"] for row in host.journal()].count("WheelsStored") == 1


def same(folder: Path) -> Path:
    """A drive to make copies of."""
    make_payload(folder / "whole", Part("same", SOUND), payload_id="org.example.same")
    return folder / "whole"


def until_pulled(host: RunningHost, name: str) -> None:
    """Wait until a drive is not shown any more."""
    host.until(
        f"{name} pulled",
        lambda view: name not in [row["drive"] for row in view["drives"]],
    )
