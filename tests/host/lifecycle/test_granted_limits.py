"""A worker may use what its payload asked for and was granted, and no more."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.host import host_in_process
from tests.kit.payloads import Part, make_payload

from nondum.host.core.records.step import Step
from nondum.host.manager.install_options import InstallOptions
from nondum.host.workers.spec import Limits
from nondum.wheelhouse.format.limits import WorkerLimits

pytestmark = pytest.mark.anyio

HEAVY = "org.example.heavy"
HELD_MB = 300
SOURCE = f"""
import os
from nondum.sdk import hookimpl

@hookimpl
def start(ctx):
    global held
    held = bytearray({HELD_MB} << 20)
    assert os.environ["OMP_NUM_THREADS"] == "{{threads}}"
"""
OPTIONS = InstallOptions(
    allow_unsigned=True,
    limits=Limits(memory_mb=HELD_MB - 50),
    most=WorkerLimits(memory_mb=HELD_MB + 100, numeric_threads=3),
)


def heavy(threads: int, *asked: str) -> Part:
    lines = "\n".join(("[component.limits]", *asked, "")) if asked else ""
    return Part("heavy", SOURCE.replace("{threads}", str(threads)), manifest=lines)


async def test_worker_has_what_its_payload_asks_for(tmp_path: Path) -> None:
    part = heavy(3, f"memory_mb = {HELD_MB + 100}", "numeric_threads = 3")
    make_payload(tmp_path / "stick", part, payload_id=HEAVY)
    async with host_in_process(tmp_path, options=OPTIONS) as host:
        host.plug(tmp_path / "stick", "stick")
        await host.until_step(HEAVY, Step.ACTIVE)
        granted = WorkerLimits(memory_mb=HELD_MB + 100, numeric_threads=3)
        assert host.workers.asked() == {"heavy": granted}


async def test_worker_that_asks_for_nothing_has_what_each_has(tmp_path: Path) -> None:
    make_payload(tmp_path / "stick", heavy(1), payload_id=HEAVY)
    async with host_in_process(tmp_path, options=OPTIONS) as host:
        host.plug(tmp_path / "stick", "stick")
        record = await host.until_step(HEAVY, Step.QUARANTINED)
        assert record.problems


async def test_payload_that_asks_for_too_much_is_refused_before_its_wheels_are_read(
    tmp_path: Path,
) -> None:
    part = heavy(4, f"memory_mb = {HELD_MB + 101}", "numeric_threads = 4")
    folder = make_payload(tmp_path / "stick", part, payload_id=HEAVY)
    for wheel in (folder / "wheels").iterdir():
        wheel.write_bytes(b"read too soon")
    async with host_in_process(tmp_path, options=OPTIONS) as host:
        host.plug(tmp_path / "stick", "stick")
        record = await host.until_step(HEAVY, Step.REFUSED)
        assert [problem.code for problem in record.problems] == ["LIMIT_NOT_GRANTED"] * 2
