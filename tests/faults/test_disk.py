"""A full disk and a damaged catalogue are told, and survived."""

from __future__ import annotations

import asyncio
import logging
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.faults.ways import LAMP_ID, sound
from tests.host.lifecycle.living import LAMP, left_over, living
from tests.payloads import Part, make_payload, make_wheel

from nondum.host import events
from nondum.host.catalogue.records import Step
from nondum.host.lifecycle.installation import InstallOptions

pytestmark = pytest.mark.anyio

TINY_MB = 24


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A host's root whose state folder is on a small file system."""
    if os.geteuid() != 0:
        pytest.skip("mounting needs root")
    root = tmp_path / "host"
    (root / "state").mkdir(parents=True)
    options = f"size={TINY_MB}m"
    mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(root / "state")]
    subprocess.run(mount, check=True)
    yield root
    subprocess.run(["umount", "--lazy", str(root / "state")], check=True)


class Complaint(logging.Handler):
    """Waits for a logger to complain."""

    def __init__(self, logger: str) -> None:
        super().__init__(logging.ERROR)
        self.heard = asyncio.Event()
        logging.getLogger(logger).addHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        self.heard.set()


def fill(file: Path) -> None:
    """Take all the room that is left."""
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
    async with living(small_disk, options=options) as host:
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
    async with living(small_disk, options=options) as host:
        host.plug(tmp_path / "drive")
        record = await host.until_step(LAMP_ID, Step.REFUSED)
        assert [problem.code for problem in record.problems] == ["DISK_FULL"]
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


async def test_full_disk_delays_the_catalogue_and_loses_nothing(
    small_disk: Path, tmp_path: Path
) -> None:
    sound(tmp_path / "drive")
    options = InstallOptions(allow_unsigned=True, reserve_mb=0)
    async with living(small_disk, options=options) as host:
        filler = small_disk / "state/filler"
        fill(filler)
        complained = Complaint("nondum.host.lifecycle.component_manager")
        host.plug(tmp_path / "drive")
        await complained.heard.wait()
        assert not host.snapshot.drives
        filler.unlink()
        await host.until_step(LAMP_ID, Step.ACTIVE)


async def test_damaged_catalogue_is_set_aside_and_drives_are_read_anew(tmp_path: Path) -> None:
    sound(tmp_path / "drive")
    async with living(tmp_path) as host:
        host.plug(tmp_path / "drive")
        await host.until_step(LAMP_ID, Step.ACTIVE)
    host.folders.catalogue.write_bytes(b"not a database" * 1000)
    async with living(tmp_path) as host:
        await host.until_step(LAMP_ID, Step.ACTIVE)
        told = [event for event in host.heard if isinstance(event, events.CatalogueSetAside)]
        assert [problem.code for problem in told[0].problems] == ["CATALOGUE_REBUILT"]
