"""Drives whose devices answer otherwise each time, fail, fall silent or never end."""

from __future__ import annotations

import errno
import os
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from tests.faults.fuse import Answer, FuseDrive, served
from tests.kit.clock import VirtualClock
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload, make_wheel
from tests.kit.until import until_async

from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.jobs.children import START_S
from nondum.host.manager.drive_reading import LOOK_S
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.installation import COPY_SILENCE_S

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(
        os.geteuid() != 0 or not Path("/dev/fuse").exists(), reason="FUSE needs root"
    ),
]

LAMP_ID = "org.example.lamp"
FOLDER = f"nondum/{LAMP_ID}"
LONGEST_SILENCE_S = max(LOOK_S, COPY_SILENCE_S, START_S)
"""Then any job is given up, whether or not it has said that it began."""
IMPATIENT = InstallOptions(allow_unsigned=True, look_s=4.0)
LIST, MANIFEST = f"{FOLDER}/CONTENTS", f"{FOLDER}/payload.toml"


@asynccontextmanager
async def lying(
    tmp_path: Path, *, answers: dict[str, Answer], options: InstallOptions | None = None
) -> AsyncIterator[tuple[HostInProcess, FuseDrive]]:
    """A host, and a drive with a sound payload on a device that gives these answers."""
    root = tmp_path / "root"
    ballast = make_wheel(tmp_path, "ballast", "1.0", {"ballast.bin": os.urandom(2**20)})
    make_payload(root, Part("lamp", LAMP, wheels=[ballast]), payload_id=LAMP_ID)
    async with host_in_process(tmp_path, options=options) as host:
        with served(root, tmp_path / "fuse") as drive:
            drive.answers |= answers
            host.plug(drive.mount)
            yield host, drive
            host.pull()
            await host.until(lambda: not host.snapshot.drives)
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


def wheel(tmp_path: Path) -> str:
    return f"{FOLDER}/wheels/ballast-1.0-py3-none-any.whl"


def bytes_of(tmp_path: Path, path: str) -> bytes:
    return (tmp_path / "root" / path).read_bytes()


def changing(tmp_path: Path, path: str) -> Answer:
    """The truth at first, then something of the same length."""

    def answer(opening: int, offset: int, size: int) -> bytes:
        data = bytes_of(tmp_path, path)
        shown = data if opening == 0 else data.replace(b"1", b"2")
        return shown[offset : offset + size]

    return answer


def endless(opening: int, offset: int, size: int) -> bytes:
    return b"x" * size


async def refused(host: HostInProcess) -> PayloadRecord:
    return await host.until_step(LAMP_ID, Step.REFUSED)


async def unreadable(host: HostInProcess, code: str) -> None:
    """The drive is told with a code, and nothing of its payload stays."""
    await host.until(lambda: any(drive.problems for drive in host.snapshot.drives))
    (drive,) = host.snapshot.drives
    assert [problem.code for problem in drive.problems] == [code]
    assert all(problem.fix for problem in drive.problems)
    await host.until_gone(LAMP_ID)


async def test_nothing_is_read_twice(tmp_path: Path) -> None:
    """A device that would answer otherwise at the second reading is not asked again; but for the
    list, which is compared."""
    paths = [MANIFEST, f"{FOLDER}/index.json", f"{FOLDER}/pylock.lamp.toml", wheel(tmp_path)]
    answers = {path: changing(tmp_path, path) for path in paths}
    async with lying(tmp_path, answers=answers) as (host, drive):
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert {path: count for path, count in drive.reads.items() if path != LIST} == {
            path: 1 for path in drive.reads if path != LIST
        }
        assert set(paths) <= drive.reads.keys()


async def test_what_is_not_listed_is_not_looked_at(tmp_path: Path) -> None:
    async with lying(tmp_path, answers={}) as (host, drive):
        folder = tmp_path / "root" / FOLDER
        (folder / "secret.txt").write_text("not listed")
        (folder.parent / "letters").mkdir()
        (folder.parent / "letters/love.txt").touch()
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert drive.listed <= {"", "nondum", FOLDER, f"{FOLDER}/wheels"}
        assert not [path for path in drive.asked if "secret" in path or "love" in path]


async def test_foreign_drive_is_left_alone(tmp_path: Path) -> None:
    """Of somebody's pictures, not even the names are read."""
    root = tmp_path / "root"
    (root / "DCIM/100CANON").mkdir(parents=True)
    (root / "DCIM/100CANON/IMG_0001.JPG").write_bytes(b"beach")
    (root / "tax.ods").write_bytes(b"private")
    async with host_in_process(tmp_path) as host:
        with served(root, tmp_path / "fuse") as drive:
            host.plug(drive.mount)
            await host.until(lambda: any(d.problems for d in host.snapshot.drives))
            (found,) = host.snapshot.drives
            assert [problem.code for problem in found.problems] == ["DRIVE_NOT_PAYLOAD"]
            assert drive.asked == {"goal.txt", "nondum", "nondum-peers", "nondum-trust"}
            assert not drive.reads
            assert drive.listed <= {""}
            host.pull()
            await host.until(lambda: not host.snapshot.drives)


async def test_list_that_is_another_one_now_is_refused(tmp_path: Path) -> None:
    async with lying(tmp_path, answers={LIST: changing(tmp_path, LIST)}) as (host, _):
        record = await refused(host)
        assert [problem.code for problem in record.problems] == ["HASH_MISMATCH"]


async def test_other_bytes_than_listed_are_refused(tmp_path: Path) -> None:
    path = wheel(tmp_path)
    answers = {path: lambda opening, offset, size: bytes_of(tmp_path, path)[offset + 1 :][:size]}
    async with lying(tmp_path, answers=answers) as (host, _):
        record = await refused(host)
        assert [problem.code for problem in record.problems] == ["HASH_MISMATCH"]


async def test_list_without_end_is_refused(tmp_path: Path) -> None:
    async with lying(tmp_path, answers={LIST: endless}) as (host, _):
        (problem,) = (await refused(host)).problems
        assert problem.code == "TOO_LARGE"


async def test_file_without_end_is_read_no_further_than_listed(tmp_path: Path) -> None:
    told: list[int] = []

    def answer(opening: int, offset: int, size: int) -> bytes:
        told.append(offset + size)
        return b"x" * size

    async with lying(tmp_path, answers={wheel(tmp_path): answer}) as (host, _):
        record = await refused(host)
        assert [problem.code for problem in record.problems] == ["HASH_MISMATCH"]
        listed = len(bytes_of(tmp_path, wheel(tmp_path)))
        assert max(told) <= listed + 2 * 2**20  # the kernel asks for what one read may take


@pytest.mark.parametrize("name", ["nondum", "nondum-trust", "nondum-peers"])
async def test_folder_without_end_is_read_no_further_than_a_person_fills_it(
    tmp_path: Path, name: str
) -> None:
    root = tmp_path / "root"
    async with host_in_process(tmp_path) as host:
        make_payload(root, Part("lamp", LAMP), payload_id=LAMP_ID)
        (root / name).mkdir(exist_ok=True)
        with served(root, tmp_path / "fuse") as drive:
            drive.endless.add(name)
            host.plug(drive.mount)
            if name == "nondum":
                await unreadable(host, "TOO_MANY_FILES")
            else:
                await host.until_step(LAMP_ID, Step.ACTIVE)
            host.pull()
            await host.until(lambda: not host.snapshot.drives)


async def test_list_that_grows_while_it_is_read_is_given_up(
    tmp_path: Path,
) -> None:
    """It is as long as it says, and a byte longer each time that somebody has come to its end."""
    told: list[int] = []

    def answer(opening: int, offset: int, size: int) -> bytes:
        told.append(offset)
        data = bytes_of(tmp_path, LIST)
        if offset >= len(data):
            time.sleep(0.01)  # so does a device that takes its time
        return data[offset : offset + size] or b"x"

    async with lying(tmp_path, answers={LIST: answer}, options=IMPATIENT) as (host, _):
        await unreadable(host, "DRIVE_STALLED")
    assert max(told) <= 256 * 1024


@pytest.mark.parametrize("path", ["list", "wheel"])
@pytest.mark.parametrize("number", [errno.EIO, errno.ENODEV, errno.ESTALE])
async def test_device_that_fails_is_gone(tmp_path: Path, path: str, number: int) -> None:
    def answer(opening: int, offset: int, size: int) -> bytes:
        raise OSError(number, "the device fails")

    where = LIST if path == "list" else wheel(tmp_path)
    async with lying(tmp_path, answers={where: answer}) as (host, _):
        await unreadable(host, "DRIVE_GONE")


@pytest.mark.parametrize("path", ["list", "wheel"])
async def test_device_that_is_silent_is_given_up(
    clock: VirtualClock, tmp_path: Path, path: str
) -> None:
    """Its child hangs in the kernel; no other process waits for it."""
    asked, over = threading.Event(), threading.Event()

    def answer(opening: int, offset: int, size: int) -> bytes:
        asked.set()
        over.wait(60.0)
        return b""

    where = LIST if path == "list" else wheel(tmp_path)
    async with lying(tmp_path, answers={where: answer}) as (host, _):
        make_payload(tmp_path / "good", Part("good", LAMP), payload_id="org.example.good")
        host.plug(tmp_path / "good", "good")
        await host.until_step("org.example.good", Step.ACTIVE)
        host.pull("good")
        await host.until_gone("org.example.good")
        await until_async("the device is asked", asked.is_set)
        await clock.advance(LONGEST_SILENCE_S)
        await host.until(lambda: any(drive.problems for drive in host.snapshot.drives))
        (problem,) = (p for drive in host.snapshot.drives for p in drive.problems)
        assert problem.code == "DRIVE_STALLED"
        await host.until_gone(LAMP_ID)
        over.set()
