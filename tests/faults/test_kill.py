"""The daemon is killed at any moment, or by what is plugged in: it comes back consistent."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from tests.faults.model import Ended, check
from tests.faults.ways import LAMP_ID, Way, sound
from tests.kit.fork_server import Nursery
from tests.kit.host import host_in_process

from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.step import Step
from nondum.host.lifecycle.crash_attribution import ATTEMPTS

pytestmark = pytest.mark.slow

KILLED = -9


def judge(ended: Ended, came: Way) -> None:
    """Nothing is wrong, and each payload that is plugged in is where it belongs."""
    assert not ended.wrong
    assert not came.out_of_place(ended.steps)


def test_kill_at_any_moment(nursery: Nursery, tmp_path: Path) -> None:
    """Each daemon goes on where the one before it was killed."""
    moments = random.Random(7)
    orders = Way().orders(tmp_path)
    for _ in range(ATTEMPTS - 2):  # `check` recovers twice, which counts as one more death
        late = moments.uniform(0.05, 1.2)
        nursery.run(orders, late_s=late, expect=KILLED)
        orders["script"] = ()
    judge(check(tmp_path), Way())


@pytest.mark.parametrize(
    ("step", "event", "left_alone"),
    [
        ("RECEIVED", "PayloadCopied", Step.REFUSED),
        ("STORED", "ComponentsProbed", Step.QUARANTINED),
    ],
)
@pytest.mark.anyio
async def test_payload_that_takes_the_daemon_along_is_left_alone(
    nursery: Nursery, tmp_path: Path, step: str, event: str, left_alone: Step
) -> None:
    orders = Way().orders(tmp_path, kill=("BEFORE", step, event))
    for _ in range(ATTEMPTS):
        nursery.run(orders, expect=KILLED)
        orders["script"] = ()
    async with host_in_process(tmp_path) as host:
        record = await host.until_step(LAMP_ID, left_alone)
        assert [problem.code for problem in record.problems] == ["QUARANTINED"]
    async with host_in_process(tmp_path) as host:
        record = await host.until_step(LAMP_ID, left_alone)
        host.bus.emit(RetryAsked(record.key))
        await host.until(lambda: host.snapshot.component("lamp") is not None)


@pytest.mark.anyio
async def test_drive_that_takes_the_daemon_along_is_left_alone(
    nursery: Nursery, tmp_path: Path
) -> None:
    """It dies while it merely looks at the drive."""
    sound(tmp_path / "drives/a")
    (tmp_path / "slots").mkdir()
    orders = {"root": str(tmp_path), "script": ("plug a",), "kill_while": "READING"}
    for _ in range(ATTEMPTS):
        nursery.run(orders, expect=KILLED)
        orders["script"] = ()
    async with host_in_process(tmp_path) as host:
        await host.until(lambda: bool(host.snapshot.drives and host.snapshot.drives[0].problems))
        (drive,) = host.snapshot.drives
        assert [problem.code for problem in drive.problems] == ["QUARANTINED"]
        assert not host.snapshot.payloads
        host.pull()
        await host.until(lambda: not host.snapshot.drives)
        host.plug(tmp_path / "drives/a")
        await host.until_step(LAMP_ID, Step.ACTIVE)


def test_daemons_that_are_told_to_end_count_for_nothing(nursery: Nursery, tmp_path: Path) -> None:
    orders = Way(script=("plug a", "end now")).orders(tmp_path)
    for _ in range(ATTEMPTS):
        nursery.run(orders, expect=0)
        orders["script"] = ("end now",)
    ended = check(tmp_path)
    judge(ended, Way())
    assert not ended.codes
