"""A full disk and a damaged catalogue are told, and survived."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import sqlite3
import subprocess
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path

import pytest
from tests.faults.ways import LAMP_ID, newer, sound
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload, make_wheel

from nondum.host.catalogue.reserve import RESERVE_BYTES
from nondum.host.core.events.catalogue import CatalogueSetAside, CatalogueWritten
from nondum.host.core.records.step import Step
from nondum.host.manager import state_lock
from nondum.host.manager.initial_components import install, uninstall
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.refusal_retry import RefusalRetry
from nondum.sdk.errors import ConfigRefused

pytestmark = pytest.mark.anyio

TINY_MB = 24
TORCH_ID = "org.example.torch"


def disk_of(root: Path, options: str) -> Path:
    """A host's root whose state folder is a separate file system."""
    (root / "state").mkdir(parents=True)
    mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(root / "state")]
    subprocess.run(mount, check=True)
    return root


@pytest.fixture
def mounted(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """Makes a host's root whose state folder is on a file system with such options."""
    if os.geteuid() != 0:
        pytest.skip("mounting needs root")
    root = tmp_path / "host"
    yield lambda options: disk_of(root, options)
    subprocess.run(["umount", "--lazy", str(root / "state")], check=True)


@pytest.fixture
def small_disk(mounted: Callable[[str], Path]) -> Path:
    return mounted(f"size={TINY_MB}m")


@contextlib.asynccontextmanager
async def host_with_both(root: Path) -> AsyncIterator[HostInProcess]:
    """A host for which one payload is installed for good, `torch`, and another is on a drive."""
    installed = make_payload(root / "usb", Part("torch", LAMP), payload_id=TORCH_ID)
    sound(root / "drive")
    async with host_in_process(root) as host:
        await install(installed, host.catalogue, host.bus)
        host.plug(root / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        yield host


def fill(file: Path) -> None:
    """Take all the space that is left."""
    with file.open("wb") as out:
        try:
            while out.write(bytes(64 * 1024)):
                out.flush()
        except OSError:
            pass


async def test_too_big_a_payload_is_refused_before_it_is_copied(
    small_disk: Path, tmp_path: Path
) -> None:
    big = make_wheel(tmp_path, "big", "1.0", {"big.bin": os.urandom(12 * 1024**2)})
    lamp = Part("lamp", LAMP, wheels=[big])
    make_payload(tmp_path / "drive", lamp, payload_id=LAMP_ID)
    options = InstallOptions(allow_unsigned=True, reserve_mb=0)
    async with host_in_process(small_disk, options=options) as host:
        host.plug(tmp_path / "drive")
        record = await host.until_step(LAMP_ID, Step.REFUSED)
        (problem,) = record.problems
        assert problem.code == "DISK_FULL"
        assert problem.need
        assert problem.have
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


async def test_full_disk_while_installing_rolls_back(small_disk: Path, tmp_path: Path) -> None:
    """The lock promises a small wheel; what it unpacks to does not fit."""
    zeros = make_wheel(tmp_path, "zeros", "1.0", {"zeros.bin": bytes(40 * 1024**2)})
    lamp = Part("lamp", LAMP, wheels=[zeros])
    make_payload(tmp_path / "drive", lamp, payload_id=LAMP_ID)
    options = InstallOptions(allow_unsigned=True, reserve_mb=0)
    async with host_in_process(small_disk, options=options) as host:
        host.plug(tmp_path / "drive")
        record = await host.until_step(LAMP_ID, Step.REFUSED)
        assert [problem.code for problem in record.problems] == ["DISK_FULL"]
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


async def test_full_disk_does_not_keep_the_catalogue_from_being_written(
    mounted: Callable[[str], Path], tmp_path: Path
) -> None:
    """A reserve was set aside, and is again once there is space; then, the payload that was refused
    for that comes in by itself."""
    sound(tmp_path / "drive")
    root = mounted("size=160m")
    async with host_in_process(root) as host:
        filler = root / "state/filler"
        fill(filler)
        host.plug(tmp_path / "drive")
        record = await host.until_step(LAMP_ID, Step.REFUSED)
        assert [problem.code for problem in record.problems] == ["DISK_FULL"]
        assert host.catalogue.unwritten is None
        assert (await host.journal())[-1].event == "PayloadRefused"
        amounts = host.executor.installation.amounts
        trying_again = RefusalRetry(host.catalogue.snapshot, amounts, host.bus.emit)
        async with asyncio.TaskGroup() as tasks:
            looking = tasks.create_task(trying_again.run())
            filler.unlink()
            await host.until(lambda: host.snapshot.component("lamp") is not None)
            looking.cancel()
        assert (root / "state/reserve").stat().st_size == RESERVE_BYTES


async def test_withdrawal_does_not_wait_for_a_disk_that_cannot_be_written(
    small_disk: Path, tmp_path: Path
) -> None:
    """It has no reserve, as when the card has become read-only."""
    sound(tmp_path / "drive")
    options = InstallOptions(allow_unsigned=True, reserve_mb=0)
    async with host_in_process(small_disk, options=options) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        filler = small_disk / "state/filler"
        fill(filler)
        host.pull()
        await host.until_gone(LAMP_ID)
        assert host.catalogue.unwritten is not None
        assert not host.snapshot.components
        filler.unlink()
        await host.until(lambda: isinstance(host.heard[-1], CatalogueWritten))
        assert "PayloadCleared" in [entry.event for entry in await host.journal()]
    async with host_in_process(small_disk, options=options) as host:
        assert not host.snapshot.payloads


async def test_disk_without_inodes_is_told(mounted: Callable[[str], Path], tmp_path: Path) -> None:
    sound(tmp_path / "drive")
    root = mounted("size=128m,nr_inodes=40")
    async with host_in_process(root) as host:
        host.plug(tmp_path / "drive")
        record = await host.until_step(LAMP_ID, Step.REFUSED)
        (problem,) = record.problems
        assert (problem.code, "inodes" in problem.message) == ("DISK_FULL", True)
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


async def test_host_does_not_start_on_a_disk_that_is_read_only(
    mounted: Callable[[str], Path],
) -> None:
    root = mounted("size=64m,ro")
    with pytest.raises(ConfigRefused) as refused:
        async with host_in_process(root):
            pass
    assert refused.value.code == "STATE_UNWRITABLE"
    with pytest.raises(ConfigRefused) as refused:
        await state_lock.lock(root / "state")
    assert refused.value.code == "STATE_UNWRITABLE"


Harm = Callable[[Path], object]

HARMS: dict[str, Harm] = {
    "damaged": lambda file: file.write_bytes(b"not a database" * 1000),
    "cut": lambda file: os.truncate(file, 5000),
    "gone": lambda file: file.unlink(),
    "log-gone": lambda file: file.with_name(f"{file.name}-wal").unlink(missing_ok=True),
}


@pytest.mark.parametrize(
    ("harm", "has_backup"),
    [("damaged", True), ("damaged", False), ("cut", False), ("gone", False), ("log-gone", True)],
)
async def test_all_that_is_here_outlives_the_catalogue(
    tmp_path: Path, harm: str, has_backup: bool
) -> None:
    """One payload is installed for good, another on a drive."""
    async with host_with_both(tmp_path) as host:
        if has_backup:
            host.catalogue.backups.make()
    shutil.rmtree(tmp_path / "usb")
    HARMS[harm](host.folders.catalogue)
    async with host_in_process(tmp_path) as host:
        await host.until_step(TORCH_ID, Step.ACTIVE)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        told = [event for event in host.heard if isinstance(event, CatalogueSetAside)]
        codes = [problem.code for event in told for problem in event.problems]
        assert codes == ([] if harm == "log-gone" else ["CATALOGUE_REBUILT"])
        assert (host.catalogue.loss is None) == (harm == "log-gone")
        await uninstall(TORCH_ID, host.catalogue, host.bus)
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


async def test_older_release_is_refused_by_a_rebuilt_catalogue(tmp_path: Path) -> None:
    """What is installed for good tells what was active here."""
    newer(tmp_path / "usb")
    installed = tmp_path / "usb/nondum" / LAMP_ID
    async with host_in_process(tmp_path) as host:
        await install(installed, host.catalogue, host.bus)
    host.folders.catalogue.unlink()
    HARMS["damaged"](host.folders.catalogue)
    sound(tmp_path / "drive")
    async with host_in_process(tmp_path) as host:
        await host.until(lambda: host.snapshot.component("lamp") is not None)
        host.plug(tmp_path / "drive")
        await host.until(lambda: any(p.step is Step.REFUSED for p in host.snapshot.payloads))
        codes = [problem.code for p in host.snapshot.payloads for problem in p.problems]
        assert codes == ["ROLLBACK"]


async def test_files_that_were_taken_away_are_told(tmp_path: Path) -> None:
    """A guest comes back from its drive; what was installed for good must be installed again."""
    async with host_with_both(tmp_path) as host:
        pass
    shutil.rmtree(host.folders.payloads)
    async with host_in_process(tmp_path) as host:
        await host.until_step(LAMP_ID, Step.ACTIVE)
        record = await host.until_step(TORCH_ID, Step.QUARANTINED)
        assert [problem.code for problem in record.problems] == ["PAYLOAD_LOST"]
        await uninstall(TORCH_ID, host.catalogue, host.bus)
        await install(tmp_path / "usb/nondum" / TORCH_ID, host.catalogue, host.bus)
        await host.until_step(TORCH_ID, Step.ACTIVE)


@pytest.mark.parametrize("has_wheels", [True, False], ids=["wheels for all", "wheels for one"])
async def test_another_python_has_what_was_made_for_the_one_before_made_again(
    tmp_path: Path, has_wheels: bool
) -> None:
    """A guest is read again from its drive where the store has no wheels for this Python."""
    async with host_with_both(tmp_path) as host:
        pass
    with contextlib.closing(sqlite3.connect(host.folders.catalogue)) as catalogue, catalogue:
        other = "replace(site_packages, '/lib/python3.', '/lib/python2.')"
        catalogue.execute(f"UPDATE components SET site_packages = {other}")
    if not has_wheels:
        shutil.rmtree(host.folders.store)
    async with host_in_process(tmp_path) as host:
        await host.until_step(LAMP_ID, Step.ACTIVE)
        record = await host.until_step(TORCH_ID, Step.ACTIVE if has_wheels else Step.QUARANTINED)
        assert [p.code for p in record.problems] == ([] if has_wheels else ["PAYLOAD_LOST"])
