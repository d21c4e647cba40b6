"""Real block devices: loop devices with a file system, mounted by mount(2) itself."""

from __future__ import annotations

import errno
import os
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest
import pyudev
from tests.host.lifecycle.living import LAMP, Living, left_over, living
from tests.payloads import Part, make_payload, make_wheel

from nondum.host.catalogue.records import DriveState, Step
from nondum.host.drives import filesystems, mounting
from nondum.host.drives.blocks import BlockSource
from nondum.host.drives.source import DriveSource
from nondum.host.lifecycle.folders import Folders
from nondum.sdk.errors import PayloadRefused

LAMP_ID = "org.example.lamp"

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(
        os.geteuid() != 0 or not Path("/dev/loop-control").exists(),
        reason="loop devices need root",
    ),
]


def image(tmp_path: Path, *parts: Part, size_mb: int = 24) -> Path:
    """An ext4 image of a drive with one payload."""
    make_payload(tmp_path / "content", *parts, payload_id=LAMP_ID)
    file = tmp_path / "drive.img"
    with file.open("wb") as out:
        out.truncate(size_mb * 1024**2)
    _run("mkfs.ext4", "-q", "-d", str(tmp_path / "content"), str(file))
    return file


@contextmanager
def attached(file: Path) -> Iterator[Path]:
    """A loop device on an image."""
    node = _run("losetup", "--find", "--show", str(file)).strip()
    try:
        yield Path(node)
    finally:
        subprocess.run(["losetup", "--detach", node], check=False, capture_output=True)


def cut_off(file: Path) -> None:
    """What lies behind gives EIO from now on, as a pulled stick does."""
    os.truncate(file, 6 * 1024**2)
    Path("/proc/sys/vm/drop_caches").write_text("1")


def detach(node: Path) -> None:
    _run("losetup", "--detach", str(node))


def sources(tmp_path: Path) -> Sequence[DriveSource]:
    """Loop devices on this test's images, and no other block device of the machine."""

    def accepts(device: pyudev.Device) -> bool:
        backing = Path(device.sys_path) / "loop/backing_file"
        return backing.exists() and backing.read_text().startswith(str(tmp_path))

    return [BlockSource(tmp_path / "state/mounts", accepts=accepts)]


async def until_drive_is(host: Living, state: DriveState) -> None:
    await host.until(lambda: any(drive.state is state for drive in host.snapshot.drives))


async def test_block_device_becomes_a_drive_and_is_safe_to_pull(tmp_path: Path) -> None:
    file = image(tmp_path, Part("lamp", LAMP))
    async with living(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file) as node:
            await host.until_step(LAMP_ID, Step.ACTIVE)
            await until_drive_is(host, DriveState.IDLE)
            detach(node)
            await host.until_gone(LAMP_ID)
        assert not host.snapshot.drives
        assert not left_over(host.folders)
        assert not mounting.mounted_below(host.folders.mounts)


async def test_device_that_was_there_before_the_daemon_is_read(tmp_path: Path) -> None:
    with attached(image(tmp_path, Part("lamp", LAMP))):
        async with living(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
            await host.until_step(LAMP_ID, Step.ACTIVE)


async def test_drive_that_fails_while_it_is_copied_is_let_go(tmp_path: Path) -> None:
    ballast = make_wheel(tmp_path, "ballast", "1.0", {"ballast.bin": os.urandom(12 * 1024**2)})
    file = image(tmp_path, Part("lamp", LAMP, wheels=[ballast]), size_mb=40)
    async with living(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file):
            cut_off(file)
            await host.until(lambda: any(drive.problems for drive in host.snapshot.drives))
            (drive,) = host.snapshot.drives
            assert [problem.code for problem in drive.problems] == ["DRIVE_GONE"]
            await host.until_gone(LAMP_ID)
            await host.until(lambda: not mounting.mounted_below(host.folders.mounts))
            assert not [path for path in left_over(host.folders) if path.name != "mounts"]


async def test_unknown_file_system_is_refused_by_name(tmp_path: Path) -> None:
    file = tmp_path / "drive.img"
    file.write_bytes(bytes(1024**2))
    async with living(tmp_path, sources=lambda folders: sources(tmp_path)) as host:
        with attached(file):
            await host.until(lambda: any(drive.problems for drive in host.snapshot.drives))
            (drive,) = host.snapshot.drives
            assert [problem.code for problem in drive.problems] == ["FS_UNSUPPORTED"]


async def test_mounts_left_by_a_killed_daemon_are_undone(tmp_path: Path) -> None:
    folders = Folders(tmp_path / "state")
    with attached(image(tmp_path, Part("lamp", LAMP))) as node:
        mounting.mount(node, folders.mounts / "left", "ext4")
        async with living(tmp_path):
            assert not mounting.mounted_below(folders.mounts)
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
        mounting.mount(node, tmp_path / "mount", "exfat")
    assert refused.value.code == "FS_ERROR"
    assert not (tmp_path / "mount").exists()


def _run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout
