"""What a whole host makes of drives with several payloads, of copies, and of bad cables."""

from __future__ import annotations

import asyncio
import contextlib
import shutil
import sqlite3
from collections.abc import Sequence
from pathlib import Path

import pytest
from tests.kit.disk_images import image, on
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.loop_devices import attached, can_be_made
from tests.kit.payloads import Part, make_payload

from nondum.host.core import payload_key
from nondum.host.core.effects import ReadDrive, ReleaseDrive
from nondum.host.core.events.drives import DriveFlapping, DriveInserted, DriveRead
from nondum.host.core.events.payloads import PayloadFound, WheelsStored
from nondum.host.core.records.step import Step
from nondum.host.jobs.children import Children
from nondum.host.manager import drive_reading
from nondum.host.manager.payload_trust import PayloadTrust, TrustOptions
from nondum.host.manager.state_folders import Folders
from nondum.host.sandbox.helper.client import HelperClient
from nondum.host.sources.drives import debounce
from nondum.host.sources.drives.blocks import BlockSource
from nondum.host.sources.drives.debounce import Debounced
from nondum.host.sources.drives.source import DriveSource
from nondum.sdk.errors import NondumError

pytestmark = pytest.mark.anyio

LAMP_ID = "org.example.lamp"


def events_of(host: HostInProcess, kind: type) -> list[object]:
    return [event for event in host.heard if type(event) is kind]


async def test_payloads_of_one_drive_are_judged_each_alone(tmp_path: Path) -> None:
    names = ("zebra", "lamp", "bad", "apple")
    for name in names:
        make_payload(tmp_path / "drive", Part(name, LAMP), payload_id=f"org.example.{name}")
    with (tmp_path / "drive/nondum/org.example.bad/index.json").open("ab") as index:
        index.write(b" ")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        for name in names:
            end = Step.REFUSED if name == "bad" else Step.ACTIVE
            await host.until_step(f"org.example.{name}", end)
        found = [event.payload_id for event in host.heard if isinstance(event, PayloadFound)]
        assert found == [f"org.example.{name}" for name in sorted(names)]
        host.pull()
        await host.until(lambda: not host.snapshot.payloads)
        assert not left_over(host.folders)


async def test_a_goal_that_lies_loose_is_told_with_its_drive(tmp_path: Path) -> None:
    make_payload(tmp_path / "drive", Part("lamp", LAMP), payload_id=LAMP_ID)
    (tmp_path / "drive/nondum/goal.txt").write_text("shine")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        await host.until(lambda: bool(events_of(host, DriveRead)))
        (drive,) = host.snapshot.drives
        assert [problem.code for problem in drive.problems] == ["GOAL_UNSIGNED"]


async def test_payload_that_came_under_a_shorter_key_keeps_it(tmp_path: Path) -> None:
    make_payload(tmp_path / "drive", Part("lamp", LAMP), payload_id=LAMP_ID)
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "drive")
        key = (await host.until_step(LAMP_ID, Step.ACTIVE)).key
    assert len(key) * 4 == 128  # bits
    short = key[: payload_key.FORMER_DIGITS]
    _rename(host.folders, key, short)
    async with host_in_process(tmp_path) as host:
        await host.until(lambda: bool(events_of(host, DriveRead)))
        assert (await host.until_step(LAMP_ID, Step.ACTIVE)).key == short
        host.pull()
        await host.until(lambda: not host.snapshot.payloads)
        assert not left_over(host.folders)
        host.plug(tmp_path / "drive")
        assert (await host.until_step(LAMP_ID, Step.ACTIVE)).key == key


def _rename(folders: Folders, key: str, short: str) -> None:
    """Leave a payload as a former version of nondum would have."""
    for folder in (folders.payload(key), folders.venvs(key), folders.scratches_of(key)):
        folder.rename(folder.with_name(short))
    connection = sqlite3.connect(folders.catalogue)
    with contextlib.closing(connection), connection:
        connection.execute("UPDATE payloads SET key = ? WHERE key = ?", (short, key))
        for table in ("sources", "components"):
            connection.execute(f"UPDATE {table} SET payload = ?", (short,))
        for column in ("venv", "site_packages", "scratch"):
            renamed = f"UPDATE components SET {column} = replace({column}, ?, ?)"
            connection.execute(renamed, (key, short))


async def test_copies_of_a_payload_are_installed_once(tmp_path: Path) -> None:
    make_payload(tmp_path / "one", Part("lamp", LAMP), payload_id=LAMP_ID)
    shutil.copytree(tmp_path / "one", tmp_path / "other")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "one", "one")
        host.plug(tmp_path / "other", "other")
        record = await host.until_step(LAMP_ID, Step.ACTIVE)
        await host.until(lambda: len(host.payload(LAMP_ID).drives) == 2)  # type: ignore[union-attr]  # it is there
        pids = host.workers.pids()
        host.pull("one")
        await host.until(lambda: len(host.snapshot.drives) == 1)
        after = await host.until_step(LAMP_ID, Step.ACTIVE)
        assert after.key == record.key
        assert host.workers.pids() == pids
        assert len(events_of(host, WheelsStored)) == 1
        host.pull("other")
        await host.until_gone(LAMP_ID)


@pytest.mark.skipif(not can_be_made(), reason="loop devices need root")
async def test_bad_cable_is_told_and_read_once_it_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel says ten times over that a stick came and went."""
    monkeypatch.setattr(debounce, "FIRST_WAIT_S", 0.2)
    monkeypatch.setattr(debounce, "MOST_WAIT_S", 0.5)

    def sources(folders: Folders) -> Sequence[DriveSource]:
        return [Debounced(BlockSource(folders.mounts, accepts=on(tmp_path)))]

    async with host_in_process(tmp_path, sources=sources) as host:
        with attached(image(tmp_path, Part("lamp", LAMP))) as node:
            say = Path(f"/sys/block/{node.name}/uevent")
            for _ in range(10):
                for action in ("remove", "add"):
                    await asyncio.to_thread(say.write_text, action)
            await host.until_step(LAMP_ID, Step.ACTIVE)
            (told,) = (event for event in host.heard if isinstance(event, DriveFlapping))
            assert [problem.code for problem in told.problems] == ["DRIVE_FLAPPING"]
            assert len(events_of(host, DriveInserted)) <= debounce.FREE_FLAPS + 1


async def test_drive_that_could_not_be_unmounted_is_not_let_go_unasked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drive_reading, "privileged", lambda: HelperClient(tmp_path / "no helper"))
    children, folders = Children(), Folders(tmp_path)
    try:
        trust = PayloadTrust("rover", folders, children, TrustOptions(), allow_unsigned=True)
        await trust.open()
        drives = drive_reading.DriveReading(children, lambda event: None, trust)
        node = tmp_path / "no node"
        with pytest.raises(NondumError):
            await drives.read(ReadDrive("sda1-3", "block", Path("/"), node, "ext4"))
        for _ in range(2):
            assert await drives.release(ReleaseDrive("sda1-3")) == ()
    finally:
        await children.close()
