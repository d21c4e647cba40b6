"""Entries of a slots folder are drives."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left, open_descriptors
from tests.kit.until import until_async

from nondum.host.core.events.drives import DriveInserted, DriveRemoved, DrivesScanned
from nondum.host.core.events.event import Event
from nondum.host.sources.drives.slots import SlotSource
from nondum.host.sources.slot_folders import AGAIN_S
from nondum.wheelhouse.store import disk

pytestmark = pytest.mark.anyio


TOO_LONG = "x" * 300
"""A link to it can be neither followed nor said to lead nowhere (ENAMETOOLONG)."""


@contextlib.asynccontextmanager
async def watched(*folders: Path) -> AsyncIterator[asyncio.Queue[Event]]:
    async with events_of(SlotSource(folders)) as told:
        yield told


@contextlib.asynccontextmanager
async def events_of(source: SlotSource) -> AsyncIterator[asyncio.Queue[Event]]:
    told: asyncio.Queue[Event] = asyncio.Queue()
    task = asyncio.create_task(source.watch(told.put_nowait))
    try:
        yield told
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def test_what_is_there_is_told_first(tmp_path: Path) -> None:
    (tmp_path / "slots/a").mkdir(parents=True)
    async with watched(tmp_path / "slots") as told:
        assert await told.get() == DriveInserted("a", tmp_path / "slots/a", "slot")
        assert await told.get() == DrivesScanned("slot", ("a",))


async def test_links_and_folders_come_and_go(tmp_path: Path) -> None:
    slots, drive, other = tmp_path / "slots", tmp_path / "drive", tmp_path / "other"
    drive.mkdir()
    other.mkdir()
    async with watched(slots) as told:
        assert await told.get() == DrivesScanned("slot", ())
        (slots / "a").symlink_to(drive)
        assert await told.get() == DriveInserted("a", slots / "a", "slot")
        other.rename(slots / "b")
        assert await told.get() == DriveInserted("b", slots / "b", "slot")
        (slots / "b").rename(other)
        assert await told.get() == DriveRemoved("b")
        (slots / "a").unlink()
        assert await told.get() == DriveRemoved("a")


async def test_drives_of_a_folder_that_cannot_be_read_for_a_moment_stay(
    tmp_path: Path, clock: VirtualClock, caplog: pytest.LogCaptureFixture
) -> None:
    slots = tmp_path / "slots"
    (slots / "a").mkdir(parents=True)
    source = SlotSource([slots])
    async with events_of(source) as told:
        assert await told.get() == DriveInserted("a", slots / "a", "slot")
        assert await told.get() == DrivesScanned("slot", ("a",))
        await until_async("the drive was looked at", lambda: not looking())
        (slots / "b").mkdir()
        with descriptors_left(0):
            await clock.settle()
            await clock.advance(AGAIN_S)
        assert [(problem.code, problem.where) for problem in source.problems] == [
            ("SLOT_UNREADABLE", str(slots))
        ]
        assert len(caplog.records) == 1
        assert told.empty()
        await clock.advance(AGAIN_S)
        assert await told.get() == DriveInserted("b", slots / "b", "slot")
        assert told.empty()
        assert source.problems == ()


def looking() -> list[str]:
    """The threads that look into slots."""
    return [thread.name for thread in threading.enumerate() if thread.name == "slots"]


async def test_drives_of_other_folders_go_while_one_cannot_be_read(tmp_path: Path) -> None:
    left, right = tmp_path / "left", tmp_path / "right"
    for drive in (left / "a", right / "b"):
        drive.mkdir(parents=True)
    source = SlotSource([left, right])
    async with events_of(source) as told:
        assert [(await told.get()) for _ in range(3)][-1] == DrivesScanned(
            "slot", ("left/a", "right/b")
        )
        left.rename(tmp_path / "away")
        left.symlink_to(TOO_LONG)
        (right / "b").rmdir()
        assert await told.get() == DriveRemoved("right/b")
        assert [problem.where for problem in source.problems] == [str(left)]
        left.unlink()
        (right / "c").mkdir()
        assert await told.get() == DriveRemoved("left/a")


async def test_drive_stays_while_its_entry_cannot_be_read(tmp_path: Path) -> None:
    slots = tmp_path / "slots"
    (slots / "a").mkdir(parents=True)
    (slots / "dangling").symlink_to(tmp_path / "nothing")
    source = SlotSource([slots])
    async with events_of(source) as told:
        assert await told.get() == DriveInserted("a", slots / "a", "slot")
        assert await told.get() == DrivesScanned("slot", ("a",))
        (slots / "a").rmdir()
        (slots / "a").symlink_to(TOO_LONG)
        (slots / "b").mkdir()
        assert await told.get() == DriveInserted("b", slots / "b", "slot")
        assert {problem.code: problem.where for problem in source.problems} == {
            "SLOT_UNREADABLE": str(slots / "a"),
            "SLOT_DANGLING": str(slots / "dangling"),
        }
        (slots / "a").unlink()
        assert await told.get() == DriveRemoved("a")


async def test_drive_goes_though_watches_cannot_be_renewed(
    tmp_path: Path, clock: VirtualClock
) -> None:
    slots = tmp_path / "slots"
    (slots / "a").mkdir(parents=True)
    async with watched(slots) as told:
        assert await told.get() == DriveInserted("a", slots / "a", "slot")
        assert await told.get() == DrivesScanned("slot", ("a",))
        await clock.settle()
        (slots / "a").rmdir()
        with descriptors_left(1):  # for reading the folder
            assert await told.get() == DriveRemoved("a")
            await clock.settle()
        await until_async("the drives were looked at", lambda: not looking())
        before = open_descriptors()
        (slots / "b").mkdir()
        assert await told.get() == DriveInserted("b", slots / "b", "slot")
        assert before <= open_descriptors()


async def test_swapped_drive_is_another_drive(tmp_path: Path) -> None:
    slots = tmp_path / "slots"
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    async with watched(slots) as told:
        await told.get()
        (slots / "a").symlink_to(tmp_path / "one")
        await told.get()
        (slots / ".next").symlink_to(tmp_path / "two")
        (slots / ".next").rename(slots / "a")
        assert await told.get() == DriveRemoved("a")
        assert await told.get() == DriveInserted("a", slots / "a", "slot")


async def test_link_that_leads_nowhere_is_a_problem_until_it_leads_somewhere(
    tmp_path: Path,
) -> None:
    """As `ln -s usb slots/` makes one, typed beside `usb`."""
    slots, drive = tmp_path / "slots", tmp_path / "usb"
    drive.mkdir()
    slots.mkdir()
    (slots / "usb").symlink_to("usb")
    source = SlotSource([slots])
    async with events_of(source) as told:
        assert await told.get() == DrivesScanned("slot", ())
        (problem,) = source.problems
        assert (problem.code, problem.where) == ("SLOT_DANGLING", str(slots / "usb"))
        (slots / ".next").symlink_to(drive)
        (slots / ".next").rename(slots / "usb")
        assert isinstance(await told.get(), DriveInserted)
        await until_async("the link is no problem any more", lambda: not source.problems)


async def test_files_and_hidden_entries_are_no_drives(tmp_path: Path) -> None:
    slots = tmp_path / "slots"
    async with watched(slots) as told:
        await told.get()
        (slots / ".hidden").mkdir()
        (slots / "file").touch()
        (slots / "a").mkdir()
        assert await told.get() == DriveInserted("a", slots / "a", "slot")


async def test_links_that_lead_nowhere_are_no_drives(tmp_path: Path) -> None:
    slots = tmp_path / "slots"
    async with watched(slots) as told:
        await told.get()
        (slots / "circle").symlink_to("circle")
        (slots / "nowhere").symlink_to(tmp_path / "nothing")
        (slots / "a").mkdir()
        assert await told.get() == DriveInserted("a", slots / "a", "slot")


@pytest.mark.parametrize("name", [b"clear\x1b[2J", b"two\nlines", b"bell\x07", b"latin-1 \xff"])
async def test_entry_with_a_name_that_cannot_be_shown_is_told_and_not_read(
    tmp_path: Path, name: bytes
) -> None:
    """The label of a stick becomes the name of the folder that it is mounted at."""
    slots = tmp_path / "slots"
    async with watched(slots) as told:
        await told.get()
        entry = slots / os.fsdecode(name)
        entry.mkdir()
        event = await told.get()
        assert isinstance(event, DriveInserted)
        assert event.drive.isprintable()
        assert [problem.code for problem in event.problems] == ["DRIVE_NAME"]
        entry.rmdir()
        assert await told.get() == DriveRemoved(event.drive)


async def test_label_of_many_letters_is_a_name(tmp_path: Path) -> None:
    slots = tmp_path / "slots"
    async with watched(slots) as told:
        await told.get()
        for name in ("Ключ, 2", "ü" * 127, "x" * 255):
            (slots / name).mkdir()
            assert await told.get() == DriveInserted(name, slots / name, "slot")


async def test_slot_folder_that_is_deleted_holds_no_drives(tmp_path: Path) -> None:
    left, right = tmp_path / "left", tmp_path / "right"
    (left / "a").mkdir(parents=True)
    async with watched(left, right) as told:
        assert await told.get() == DriveInserted("left/a", left / "a", "slot")
        await told.get()
        shutil.rmtree(left)
        assert await told.get() == DriveRemoved("left/a")
        (right / "b").mkdir()
        assert await told.get() == DriveInserted("right/b", right / "b", "slot")


async def test_drives_of_several_folders_have_names_of_their_own(tmp_path: Path) -> None:
    for folder in ("left", "right"):
        (tmp_path / folder / "a").mkdir(parents=True)
    async with watched(tmp_path / "left", tmp_path / "right") as told:
        names = [
            event.drive
            for event in (await told.get(), await told.get())
            if isinstance(event, DriveInserted)
        ]
        assert names == ["left/a", "right/a"]


async def ticked(folder: Path) -> None:
    """Wait until a file that is written from now on has a later time than any before."""
    now_ns, file = time.time_ns(), folder / "written"

    def written_ns() -> int:
        file.write_text("")
        return file.stat().st_ctime_ns

    await until_async("a tick of the file system", lambda: written_ns() > now_ns)


@contextlib.asynccontextmanager
async def plugged(folder: Path) -> AsyncIterator[tuple[asyncio.Queue[Event], Path, Path]]:
    """What is told from now on, the folder of slots, and the drive in slot `a` of it."""
    slots, drive = folder / "slots", folder / "drive"
    async with watched(slots) as told:
        await told.get()
        (slots / "a").symlink_to(drive)
        await told.get()
        await ticked(folder)
        yield told, slots, drive


def write_payload(drive: Path, text: str, name: str = "org.example.lamp") -> None:
    """Put a payload's list there as `payload build` does: the folder is whole when it appears."""
    folder = drive / "nondum" / name
    beside = folder.with_name(f".{name}.part")
    beside.mkdir(parents=True)
    (beside / "CONTENTS").write_text(text)
    if folder.exists():
        assert disk.exchange(beside, folder)
        shutil.rmtree(beside)
    else:
        beside.rename(folder)


@pytest.mark.parametrize("is_link", [True, False], ids=["link", "folder"])
async def test_payload_that_is_built_again_in_place_is_told_without_a_removal(
    tmp_path: Path, is_link: bool
) -> None:
    slots = tmp_path / "slots"
    drive = tmp_path / "drive" if is_link else slots / "a"
    write_payload(drive, "first")
    async with watched(slots) as told:
        if is_link:
            await told.get()
            (slots / "a").symlink_to(drive)
        assert await told.get() == DriveInserted("a", slots / "a", "slot")
        if not is_link:
            await told.get()
        await ticked(tmp_path)
        for text in ("second", "third"):
            write_payload(drive, text)
            assert await told.get() == DriveInserted("a", slots / "a", "slot")
            await ticked(tmp_path)
        assert told.empty()


async def test_signature_that_comes_later_is_told(tmp_path: Path) -> None:
    write_payload(tmp_path / "drive", "first")
    async with plugged(tmp_path) as (told, slots, drive):
        disk.write(drive / "nondum/org.example.lamp/CONTENTS.sig", b"signed")
        assert await told.get() == DriveInserted("a", slots / "a", "slot")


async def test_payload_that_comes_and_one_that_goes_are_told(tmp_path: Path) -> None:
    (tmp_path / "drive").mkdir()
    async with plugged(tmp_path) as (told, slots, drive):
        write_payload(drive, "first")
        assert await told.get() == DriveInserted("a", slots / "a", "slot")
        await ticked(tmp_path)
        (drive / "nondum/org.example.lamp").rename(tmp_path / "elsewhere")
        assert await told.get() == DriveInserted("a", slots / "a", "slot")


async def test_what_is_not_listed_yet_is_not_told(tmp_path: Path) -> None:
    """A folder that is being copied by hand: nothing is known of it before its list is there."""
    write_payload(tmp_path / "drive", "first")
    async with plugged(tmp_path) as (told, slots, drive):
        (drive / "nondum/org.example.other/wheels").mkdir(parents=True)
        (drive / "nondum/org.example.lamp/notes.txt").write_text("mine")
        await ticked(tmp_path)
        (slots / "b").mkdir()
        assert await told.get() == DriveInserted("b", slots / "b", "slot")


@pytest.mark.parametrize("how", ["deleted", "moved", "moved above"])
async def test_link_is_pulled_with_its_folder_and_comes_back_with_it(
    tmp_path: Path, how: str
) -> None:
    slots, drive = tmp_path / "slots", tmp_path / "work/drive"
    write_payload(drive, "first")
    async with watched(slots) as told:
        await told.get()
        (slots / "a").symlink_to(drive)
        await told.get()
        await ticked(tmp_path)
        if how == "deleted":
            shutil.rmtree(drive)
        else:
            moved = drive if how == "moved" else drive.parent
            moved.rename(tmp_path / "elsewhere")
        while (event := await told.get()) != DriveRemoved("a"):
            assert event == DriveInserted("a", slots / "a", "slot")
        await ticked(tmp_path)
        write_payload(tmp_path / "new", "second")
        drive.parent.mkdir(exist_ok=True)
        (tmp_path / "new").rename(drive)
        assert await told.get() == DriveInserted("a", slots / "a", "slot")
