"""The daemon is killed at every commit of every transition, and comes back consistent by itself."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.faults.model import Ended, check
from tests.faults.ways import COMPONENT_WAYS, LAMP_ID, Way, sound, way
from tests.kit.fork_server import Nursery
from tests.kit.host import host_in_process

from nondum.host import events
from nondum.host.catalogue.records import ComponentState, Step
from nondum.host.events import Event
from nondum.host.lifecycle.tries import ATTEMPTS
from nondum.host.transitions import COMPONENT_TRANSITIONS, TRANSITIONS

pytestmark = pytest.mark.slow

KILLED = -9


def named(value: object) -> str:
    return getattr(value, "__name__", str(value))


def judge(ended: Ended, came: Way) -> None:
    """Nothing is wrong, and each payload that is plugged in is where it belongs."""
    assert not ended.wrong
    assert not came.out_of_place(ended.steps)


ENDINGS = (events.PayloadSentAway, events.PayloadDistrusted, events.PayloadWithdrawn)
"""What may come at any step."""


def boundaries() -> Iterator[tuple[Step, type[Event], str]]:
    """After the commit of each row, but of one ending only for each step: they are one mechanism.
    Before it where a payload goes forward; otherwise there is what led there. The long form goes
    through all of them."""
    endings = itertools.cycle(ENDINGS)
    ending = {step: next(endings) for step in Step}
    ending[Step.REFUSED] = events.PayloadWithdrawn
    for (step, event), row in TRANSITIONS.items():
        if event not in ENDINGS or ending[step] is event:
            yield step, event, "AFTER"
        if row.effect is not None and event not in ENDINGS and row.to in FORWARD:
            yield step, event, "BEFORE"


FORWARD = (Step.COPIED, Step.VERIFIED, Step.STAGED, Step.STORED, Step.PROBED, Step.ACTIVE)
BOUNDARIES = list(boundaries())


def test_every_ending_is_tried() -> None:
    assert {event for _, event, _ in BOUNDARIES} == {event for _, event in TRANSITIONS}
    assert {step for step, _, _ in BOUNDARIES} == {step for step, _ in TRANSITIONS}


@pytest.mark.parametrize(("step", "event", "when"), BOUNDARIES, ids=named)
def test_kill_at_a_transition(
    nursery: Nursery, tmp_path: Path, step: Step, event: type[Event], when: str
) -> None:
    came = way(step, event)
    orders = came.orders(tmp_path, kill=(when, step.name, event.__name__))
    nursery.run(orders, expect=KILLED)
    judge(check(tmp_path), came)


@pytest.mark.parametrize(("state", "event"), COMPONENT_TRANSITIONS, ids=named)
def test_kill_at_a_transition_of_a_component(
    nursery: Nursery, tmp_path: Path, state: ComponentState, event: type[Event]
) -> None:
    came = COMPONENT_WAYS[state, event]
    orders = came.orders(tmp_path, kill=("AFTER", state.name, event.__name__))
    nursery.run(orders, expect=KILLED)
    judge(check(tmp_path), came)


def test_kill_at_any_moment(nursery: Nursery, tmp_path: Path) -> None:
    """Each daemon goes on where the one before it was killed."""
    moments = random.Random(7)
    orders = Way().orders(tmp_path)
    for _ in range(ATTEMPTS - 1):
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
        host.bus.emit(events.RetryAsked(record.key))
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
