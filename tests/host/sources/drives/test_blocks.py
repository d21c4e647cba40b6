"""Real block devices: loop devices with a file system, mounted by mount(2) itself."""

from __future__ import annotations

import asyncio
import ctypes
import errno
import fcntl
import hashlib
import os
import struct
from collections.abc import Sequence
from pathlib import Path

import pytest
from tests.host.sources.drives.usb_devices import stick
from tests.kit.disk_images import LAMP_ID, attribute, cut_off, image, make_ext4, on, run
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.loop_devices import attached, can_be_made, detach
from tests.kit.payloads import Part, make_wheel
from tests.kit.traces import until_unmounted

from nondum.host.core.events.drives import DriveRead
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.step import Step
from nondum.host.manager.state_folders import Folders
from nondum.host.sandbox.helper import drive_nodes, filesystems, mounting
from nondum.host.sandbox.helper.mountinfo import mounted_below
from nondum.host.sources.drives.blocks import BlockSource
from nondum.host.sources.drives.source import DriveSource
from nondum.sdk.errors import DriveGone, PayloadRefused

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(not can_be_made(), reason="loop devices need root"),
]


def sources(tmp_path: Path) -> Sequence[DriveSource]:
    return [BlockSource(tmp_path / "state/mounts", accepts=on(tmp_path))]


async def until_drive_is(host: HostInProcess, state: DriveState) -> None:
    await host.until(lambda: any(drive.state is state for drive in host.snapshot.drives))


async def test_block_device_becomes_a_drive_and_is_safe_to_pull(tmp_path: Path) -> None:
    file = image(tmp_path, Part("lamp", LAMP))
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file) as node:
            await host.until_step(LAMP_ID, Step.ACTIVE)
            await until_drive_is(host, DriveState.IDLE)
            detach(node)
            await host.until_gone(LAMP_ID)
        assert not host.snapshot.drives
        assert not left_over(host.folders)
        assert not mounted_below(host.folders.mounts)


async def test_device_that_was_there_before_the_daemon_is_read(tmp_path: Path) -> None:
    with attached(image(tmp_path, Part("lamp", LAMP))):
        async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
            await host.until_step(LAMP_ID, Step.ACTIVE)


async def test_drive_that_fails_while_it_is_copied_is_let_go(tmp_path: Path) -> None:
    ballast = make_wheel(tmp_path, "ballast", "1.0", {"ballast.bin": os.urandom(12 * 1024**2)})
    file = image(tmp_path, Part("lamp", LAMP, wheels=[ballast]), size_mb=40)
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file):
            cut_off(file)
            await host.until(lambda: any(drive.problems for drive in host.snapshot.drives))
            (drive,) = host.snapshot.drives
            assert [problem.code for problem in drive.problems] == ["DRIVE_GONE"]
            await host.until_gone(LAMP_ID)
            await host.until(lambda: not mounted_below(host.folders.mounts))
            assert not [path for path in left_over(host.folders) if path.name != "mounts"]


async def test_unknown_file_system_is_refused_by_name(tmp_path: Path) -> None:
    file = tmp_path / "drive.img"
    file.write_bytes(bytes(1024**2))
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file):
            await host.until(lambda: any(drive.problems for drive in host.snapshot.drives))
            (drive,) = host.snapshot.drives
            assert [problem.code for problem in drive.problems] == ["FS_UNSUPPORTED"]


def options_of(target: Path) -> set[str]:
    """Those of a mount and of its file system, as the kernel tells them."""
    lines = Path("/proc/self/mountinfo").read_text().splitlines()
    (line,) = (line.split() for line in lines if line.split()[4] == str(target))
    return {*line[5].split(","), *line[-1].split(",")}


@pytest.mark.parametrize("panics", [True, False], ids=["wants-a-panic", "as-it-is-made"])
def test_drive_has_no_say_in_how_it_is_mounted(tmp_path: Path, panics: bool) -> None:
    """The superblock of an ext4 can say that the kernel is to panic once it finds an error."""
    file, target = image(tmp_path, Part("lamp", LAMP)), tmp_path / "mount"
    if panics:
        run("tune2fs", "-e", "panic", "-o", "debug,user_xattr,acl", str(file))
    with attached(file) as node:
        mounting.mount(node, target, "ext4")
        try:
            given = options_of(target)
        finally:
            mounting.unmount(target)
    assert {"ro", "nosuid", "nodev", "noexec", "nosymfollow"} <= given
    assert "errors=panic" not in given


async def test_file_system_that_tears_under_a_reader_is_told_as_that(tmp_path: Path) -> None:
    """Its list lies, by its own word, where the device has no bytes."""
    file = image(tmp_path, Part("lamp", LAMP))
    run("debugfs", "-w", "-R", f"sif /nondum/{LAMP_ID}/CONTENTS block[5] 999999999", str(file))
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file):
            await host.until(lambda: bool(host.snapshot.payloads))
            record = await host.until_step(LAMP_ID, Step.REFUSED)
            assert [problem.code for problem in record.problems] == ["FS_ERROR"]


async def test_mounts_left_by_a_killed_daemon_are_undone(tmp_path: Path) -> None:
    folders = Folders(tmp_path / "state")
    with attached(image(tmp_path, Part("lamp", LAMP))) as node:
        mounting.mount(node, folders.mounts / "left", "ext4")
        async with host_in_process(tmp_path):
            assert not mounted_below(folders.mounts)
            assert not list(folders.mounts.iterdir())


def test_drive_is_mounted_without_powers(tmp_path: Path) -> None:
    content = tmp_path / "content"
    content.mkdir()
    (content / "link").symlink_to("/etc/passwd")
    (content / "run").write_text("#!/bin/sh\n")
    (content / "run").chmod(0o755)
    file = image(tmp_path, Part("lamp", LAMP))
    target = tmp_path / "mount"
    with attached(file) as node:
        assert filesystems.probe(node) == "ext4"
        mounting.mount(node, target, "ext4")
        try:
            for attempt, code in (
                (lambda: (target / "new").touch(), errno.EROFS),
                (lambda: (target / "link").read_text(), errno.ELOOP),
                (lambda: os.execv(target / "run", ["run"]), errno.EACCES),
            ):
                with pytest.raises(OSError) as refused:
                    attempt()
                assert refused.value.errno == code
        finally:
            mounting.unmount(target)
    assert not target.exists()


def test_wrong_file_system_is_told(tmp_path: Path) -> None:
    file = image(tmp_path, Part("lamp", LAMP))
    with attached(file) as node, pytest.raises(PayloadRefused) as refused:
        mounting.mount(node, tmp_path / "mount", "ext2")
    assert refused.value.code == "FS_ERROR"
    assert not (tmp_path / "mount").exists()


def test_file_system_that_the_kernel_does_not_know_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mounting, "FILESYSTEMS", {"ext9": ""})
    file = image(tmp_path, Part("lamp", LAMP))
    with attached(file) as node, pytest.raises(PayloadRefused) as refused:
        mounting.mount(node, tmp_path / "mount", "ext9")
    assert refused.value.code == "FS_UNSUPPORTED"


def test_drive_that_goes_while_it_is_mounted_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Kernel:
        """One that finds the device gone."""

        def mount(self, *_: object) -> int:
            (tmp_path / "node").unlink()
            ctypes.set_errno(errno.EIO)
            return -1

    with attached(image(tmp_path, Part("lamp", LAMP))) as node:
        (tmp_path / "node").symlink_to(node)
        monkeypatch.setattr(mounting, "_libc", Kernel())
        with pytest.raises(DriveGone) as gone:
            mounting.mount(tmp_path / "node", tmp_path / "mount", "ext4")
    assert gone.value.code == "DRIVE_GONE"


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def dirty(tmp_path: Path) -> Path:
    """An image as a stick has it that was pulled while it was written to: its journal is full."""
    clean, folder, file = image(tmp_path, Part("lamp", LAMP)), tmp_path / "rw", tmp_path / "dirty"
    folder.mkdir()
    run("mount", "-o", "loop", str(clean), str(folder))
    try:
        (folder / "letter").write_text("dear robot")
        run("sync", "-f", str(folder))
        (folder / "letter").write_text("never finished")
        run("sync", "-f", str(folder))
        file.write_bytes(clean.read_bytes())
    finally:
        run("umount", str(folder))
    assert "needs_recovery" in run("dumpe2fs", "-h", str(file))
    return file


async def test_nothing_is_written_to_a_drive(tmp_path: Path) -> None:
    file = dirty(tmp_path)
    before = digest(file)
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file) as node:
            await host.until_step(LAMP_ID, Step.ACTIVE)
            await until_drive_is(host, DriveState.IDLE)
            run("sync")
            assert digest(file) == before
            assert attribute(node, "ro") == 1
            with pytest.raises(OSError), node.open("r+b", buffering=0) as device:
                device.write(bytes(512))


async def test_drive_that_came_in_place_of_another_is_not_taken_for_it(tmp_path: Path) -> None:
    """What is mounted is what was announced: a node's name is no identity."""
    with attached(image(tmp_path, Part("lamp", LAMP))) as node:
        number = attribute(node, "diskseq")
        with drive_nodes.held(node, drive_nodes.drive_name(node.name, number)) as source:
            assert source.resolve() == node
        with pytest.raises(DriveGone) as gone, drive_nodes.held(node, f"{node.name}-{number - 1}"):
            raise AssertionError("another drive was taken for it")
        assert gone.value.code == "DRIVE_GONE"
        with pytest.raises(DriveGone):
            mounting.mount(node, tmp_path / "mount", "ext4", drive=f"{node.name}-1")
        assert not (tmp_path / "mount").exists()


async def test_next_stick_in_the_same_node_is_another_drive(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    other = image(second, Part("other", LAMP), payload_id="org.example.other")
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(image(first, Part("lamp", LAMP))) as node:
            await host.until_step(LAMP_ID, Step.ACTIVE)
            (before,) = (drive.id for drive in host.snapshot.drives)
            detach(node)
            await asyncio.to_thread(run, "losetup", str(node), str(other))
            await host.until_step("org.example.other", Step.ACTIVE)
            await host.until_gone(LAMP_ID)
            (after,) = (drive.id for drive in host.snapshot.drives)
            assert before.split("-")[0] == after.split("-")[0] == node.name
            assert before != after
            detach(node)


async def test_drive_without_payloads_is_let_go_unread(tmp_path: Path) -> None:
    content = tmp_path / "content"
    (content / "holiday").mkdir(parents=True)
    (content / "holiday/beach.jpg").write_bytes(b"sand")
    file = tmp_path / "drive.img"
    make_ext4(content, file)
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file):
            await until_drive_is(host, DriveState.IDLE)
            (drive,) = host.snapshot.drives
            assert [problem.code for problem in drive.problems] == ["DRIVE_NOT_PAYLOAD"]
            await asyncio.to_thread(until_unmounted, host.folders.mounts)


def partitioned(tmp_path: Path, *images: Path) -> Path:
    """A disk that is to have a partition of each image, one after the other."""
    disk = tmp_path / "disk.img"
    with disk.open("wb") as out:
        out.write(bytes(PARTITION))
        for file in images:
            out.write(file.read_bytes().ljust(PARTITION, b"\0"))
    return disk


def partition(node: Path, number: int) -> None:
    """Have a disk's partition known, as reading its table does (BLKPG): kernels read few kinds."""
    entry = struct.pack("<qqi64s64s4x", number * PARTITION, PARTITION, number, b"", b"")
    buffer = ctypes.create_string_buffer(entry, len(entry))
    argument = struct.pack("<iiixxxxQ", 1, 0, len(entry), ctypes.addressof(buffer))
    with node.open("rb") as disk:
        fcntl.ioctl(disk, 0x1269, argument)


PARTITION = 24 * 2**20


async def test_each_partition_is_judged_alone(tmp_path: Path) -> None:
    good = image(tmp_path / "good", Part("lamp", LAMP))
    bad = image(tmp_path / "bad", Part("worse", LAMP), payload_id="org.example.worse", spoilt=True)
    disk = partitioned(tmp_path, good, bad)
    async with host_in_process(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(disk) as node:
            for number in (1, 2):
                partition(node, number)
            await host.until_step(LAMP_ID, Step.ACTIVE)
            record = await host.until_step("org.example.worse", Step.REFUSED)
            assert [problem.code for problem in record.problems] == ["HASH_MISMATCH"]
            names = sorted(drive.id for drive in host.snapshot.drives)
            assert [name.split("-")[0][-2:] for name in names] == ["p1", "p2"]


async def test_composite_stick_is_refused_unread(tmp_path: Path) -> None:
    """The loop device hangs, in a sysfs of the test's own, on a stick that is a keyboard too."""
    file = image(tmp_path, Part("lamp", LAMP))
    with attached(file) as node:
        sysfs = tmp_path / "sys"
        place = sysfs / "devices/virtual/block"
        place.mkdir(parents=True)
        (place / node.name).symlink_to(stick(sysfs, "08", "03"))

        def composite(folders: Folders) -> Sequence[DriveSource]:
            return [BlockSource(folders.mounts, accepts=on(tmp_path), sysfs=sysfs)]

        async with host_in_process(tmp_path, sources=composite) as host:
            await until_drive_is(host, DriveState.IDLE)
            (drive,) = host.snapshot.drives
            assert [problem.code for problem in drive.problems] == ["USB_EXTRA_INTERFACE"]
            assert not [e for e in host.heard if isinstance(e, DriveRead)]
            assert attribute(node, "ro") == 0, "it was not touched"

        def allowed(folders: Folders) -> Sequence[DriveSource]:
            accepts = on(tmp_path)
            rule = BlockSource(folders.mounts, accepts=accepts, sysfs=sysfs, single_function=False)
            return [rule]

        async with host_in_process(tmp_path, sources=allowed) as host:
            await host.until_step(LAMP_ID, Step.ACTIVE)
