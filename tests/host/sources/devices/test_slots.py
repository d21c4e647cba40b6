"""Device slots: files appear, change and go, and devices with them."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left

from nondum.host.core.events.devices import DeviceAppeared, DeviceRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.records.device import DeviceNode
from nondum.host.sources.devices import DeviceSlotSource
from nondum.host.sources.devices.slots import parse_slot
from nondum.host.sources.slot_folders import AGAIN_S
from nondum.sdk.errors import ConfigRefused

CAMERA = '[device]\nnode = "/dev/video0"\n[device.properties]\nID_BUS = "usb"\n'


@asynccontextmanager
async def watching(*folders: Path) -> AsyncIterator[asyncio.Queue[Event]]:
    """What a source of these folders tells while the context lasts."""
    async with events_of(DeviceSlotSource(folders)) as told:
        yield told


@asynccontextmanager
async def events_of(source: DeviceSlotSource) -> AsyncIterator[asyncio.Queue[Event]]:
    """What a source tells while the context lasts."""
    told: asyncio.Queue[Event] = asyncio.Queue()
    task = asyncio.create_task(source.watch(told.put_nowait))
    try:
        yield told
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def next_event(told: asyncio.Queue[Event]) -> Event:
    return await asyncio.wait_for(told.get(), 30.0)


@pytest.mark.anyio
async def test_devices_that_are_there_are_told(tmp_path: Path) -> None:
    (tmp_path / "front.toml").write_text(CAMERA)
    async with watching(tmp_path) as told:
        event = await next_event(told)
    assert isinstance(event, DeviceAppeared)
    assert event.found.nodes == (DeviceNode(Path("/dev/video0"), {"ID_BUS": "usb"}),)


@pytest.mark.anyio
async def test_devices_come_and_go(tmp_path: Path) -> None:
    async with watching(tmp_path / "made") as told:
        await asyncio.sleep(0)
        file = tmp_path / "made/front.toml"
        unfinished = tmp_path / "made/.front.part"
        unfinished.write_text(CAMERA)
        unfinished.rename(file)
        assert isinstance(await next_event(told), DeviceAppeared)
        file.unlink()
        assert await next_event(told) == DeviceRemoved("front")


@pytest.mark.anyio
async def test_device_that_changes_is_replugged(tmp_path: Path) -> None:
    file = tmp_path / "front.toml"
    file.write_text(CAMERA)
    async with watching(tmp_path) as told:
        await next_event(told)
        file.write_text(CAMERA.replace("video0", "video1"))
        # Written in place, it may also be seen empty in between: that is no device.
        assert await next_event(told) == DeviceRemoved("front")
        event = await next_event(told)
        assert isinstance(event, DeviceAppeared)
        assert event.found.nodes[0].node == Path("/dev/video1")


@pytest.mark.anyio
async def test_broken_file_hurts_no_other(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "a.toml").write_text("[device\n")
    (tmp_path / "b.toml").write_text(CAMERA)
    (tmp_path / "notes.txt").write_text("no device")
    async with watching(tmp_path) as told:
        event = await next_event(told)
    assert isinstance(event, DeviceAppeared)
    assert event.device == "b"
    assert "DEVICE_SLOT" in caplog.text
    assert told.empty()


@pytest.mark.anyio
async def test_files_that_stand_for_no_device_are_problems_until_they_are_mended(
    tmp_path: Path,
) -> None:
    (tmp_path / "files").mkdir()
    slots, file = tmp_path / "slots", tmp_path / "files/eye.toml"
    slots.mkdir()
    file.write_text(CAMERA)
    (slots / "a.toml").write_text("[device\n")
    os.mkfifo(slots / "pipe.toml")
    (slots / "eye.toml").symlink_to("files/eye.toml")  # that is slots/files/eye.toml
    (slots / "front.toml").write_text(CAMERA)
    source = DeviceSlotSource([slots])
    async with events_of(source) as told:
        await next_event(told)
        found = {Path(problem.where).name: problem for problem in source.problems}
        assert {name: problem.code for name, problem in found.items()} == {
            "a.toml": "DEVICE_SLOT",
            "pipe.toml": "DEVICE_SLOT",
            "eye.toml": "SLOT_DANGLING",
        }
        assert str(slots / "files/eye.toml") in found["eye.toml"].message
        (slots / "a.toml").unlink()
        (slots / "pipe.toml").unlink()
        (slots / ".next").symlink_to(file)
        (slots / ".next").rename(slots / "eye.toml")
        assert isinstance(await next_event(told), DeviceAppeared)
        assert source.problems == ()


@pytest.mark.anyio
async def test_devices_of_a_folder_that_cannot_be_read_for_a_moment_stay(
    tmp_path: Path, clock: VirtualClock
) -> None:
    (tmp_path / "a.toml").write_text(CAMERA)
    source = DeviceSlotSource([tmp_path])
    async with events_of(source) as told:
        assert isinstance(await told.get(), DeviceAppeared)
        (tmp_path / ".b").write_text(CAMERA)
        with descriptors_left(0):
            (tmp_path / ".b").rename(tmp_path / "b.toml")
            await clock.settle()
            await clock.advance(AGAIN_S)
        (problem,) = source.problems
        assert (problem.code, problem.where) == ("SLOT_UNREADABLE", str(tmp_path))
        assert told.empty()
        await clock.advance(AGAIN_S)
        event = await told.get()
        assert isinstance(event, DeviceAppeared)
        assert event.device == "b"
        assert source.problems == ()


@pytest.mark.anyio
async def test_devices_of_other_folders_go_while_one_cannot_be_read(tmp_path: Path) -> None:
    left, right = tmp_path / "left", tmp_path / "right"
    for folder in (left, right):
        folder.mkdir()
        (folder / "eye.toml").write_text(CAMERA)
    (left / "bad.toml").write_text("[device\n")
    source = DeviceSlotSource([left, right])
    async with events_of(source) as told:
        for _ in range(2):
            await next_event(told)
        left.rename(tmp_path / "away")
        left.symlink_to("x" * 300)  # ENAMETOOLONG: not to be followed, nor said to lead nowhere
        (right / "eye.toml").unlink()
        event = await next_event(told)
        assert isinstance(event, DeviceRemoved)
        assert event.device == "right/eye"
        assert {problem.code: problem.where for problem in source.problems} == {
            "DEVICE_SLOT": str(left / "bad.toml"),
            "SLOT_UNREADABLE": str(left),
        }


@pytest.mark.anyio
async def test_device_stays_while_its_file_cannot_be_read(
    tmp_path: Path, clock: VirtualClock
) -> None:
    file = tmp_path / "a.toml"
    file.write_text(CAMERA)
    source = DeviceSlotSource([tmp_path])
    async with events_of(source) as told:
        assert isinstance(await told.get(), DeviceAppeared)
        (tmp_path / ".next").symlink_to("/proc/self/mem")  # reading its first byte is an EIO
        (tmp_path / ".next").rename(file)
        await clock.settle()
        (problem,) = source.problems
        assert (problem.code, problem.where) == ("SLOT_UNREADABLE", str(file))
        assert told.empty()
        file.unlink()
        await clock.advance(AGAIN_S)
        assert isinstance(await told.get(), DeviceRemoved)
        assert source.problems == ()


@pytest.mark.anyio
async def test_two_folders_keep_their_devices_apart(tmp_path: Path) -> None:
    for folder in ("left", "right"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "eye.toml").write_text(CAMERA)
    async with watching(tmp_path / "left", tmp_path / "right") as told:
        names = {getattr(await next_event(told), "device", "") for _ in range(2)}
    assert names == {"left/eye", "right/eye"}


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("", id="empty"),
        pytest.param("[device]", id="no node"),
        pytest.param('[device]\nnode = ""', id="empty node"),
        pytest.param("[device]\nnode = 3", id="node is no text"),
        pytest.param('[device]\nnode = "/dev/a"\nnodes = []', id="unknown key"),
        pytest.param("[device]\nnodes = []", id="no nodes"),
        pytest.param('[device]\nnodes = ["/dev/a"]', id="node is no table"),
        pytest.param('[device]\nnodes = [{ node = "/dev/a" }]\nx = 1', id="unknown key of many"),
        pytest.param('[device]\nnode = "/dev/a"\n[other]', id="unknown table"),
        pytest.param('[device]\nnode = "/dev/a"\nproperties = 1', id="properties are no table"),
        pytest.param('[device]\nnode = "/dev/a"\nproperties = { A = 1 }', id="no string"),
        pytest.param(f"[device]\nnode = {'9' * 5_000}", id="number without end"),
    ],
)
def test_slot_file_is_refused(text: str) -> None:
    with pytest.raises(ConfigRefused, match="DEVICE_SLOT"):
        parse_slot(text, "x.toml")


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        parse_slot(text, "x.toml")
    except ConfigRefused as refused:
        assert refused.code == "DEVICE_SLOT"


def test_device_of_several_nodes_has_what_they_share_and_what_each_has() -> None:
    text = """[device]
nodes = [{ node = "/dev/video0" }, { node = "/dev/video1", properties = { N = "1" } }]
properties = { ID_VENDOR_ID = "046d" }
"""
    assert parse_slot(text, "a.toml") == (
        DeviceNode(Path("/dev/video0"), {"ID_VENDOR_ID": "046d"}),
        DeviceNode(Path("/dev/video1"), {"ID_VENDOR_ID": "046d", "N": "1"}),
    )
