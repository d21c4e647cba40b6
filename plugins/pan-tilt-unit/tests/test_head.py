"""The head is set up from any state, and says what is wrong when it does not obey."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator

import pytest
from ptu_bench import Bench

from nondum.sdk.errors import BehaviourFailed
from nondum.sdk.serial_line import SerialLine
from nondum_pan_tilt_unit.head import BAUD, Aim, Head

pytestmark = pytest.mark.anyio
SPEED = math.radians(60)


@pytest.fixture
async def head(bench: Bench) -> AsyncIterator[Head]:
    with SerialLine(bench.node("head"), BAUD) as line:
        yield Head(line)


async def test_a_unit_of_factory_settings_is_set_up(bench: Bench, head: Head) -> None:
    await head.ready(speed_rad_s=SPEED)
    assert (head.pan.minimum, head.tilt.maximum) == (-3090, 604)
    assert head.pan.resolution_rad == pytest.approx(math.radians(0.0514285), rel=1e-5)
    assert "PS1167" in bench.commands
    assert not bench.is_echoing


async def test_what_was_said_before_is_not_taken_for_an_answer(bench: Bench, head: Head) -> None:
    bench.noise(b"!P* 12345\r\n* half of some")
    await head.ready(speed_rad_s=SPEED)
    assert await head.position() == Aim(300, -100)


async def test_it_turns_and_reports_it(bench: Bench, head: Head) -> None:
    await head.ready(speed_rad_s=SPEED)
    await head.turn(Aim(-500, 200))
    assert await head.position() == Aim(-500, 200)


@pytest.mark.parametrize("speed", [0.0001, 99.0], ids=["slower", "faster"])
async def test_speed_stays_within_the_units_bounds(bench: Bench, head: Head, speed: float) -> None:
    await head.ready(speed_rad_s=speed)
    assert {"PS31", "TS31"} <= set(bench.commands) or {"PS2902", "TS2902"} <= set(bench.commands)


async def test_a_reset_runs_into_the_ends_on_purpose(bench: Bench, head: Head) -> None:
    await head.ready(speed_rad_s=SPEED, reset=True)
    assert "R" in bench.commands


async def test_a_silent_unit_is_told(bench: Bench, head: Head) -> None:
    bench.is_silent = True
    with pytest.raises(BehaviourFailed, match=r"PTU_SILENT .*no answer to 'FT'"):
        await head.ready(speed_rad_s=SPEED)


async def test_a_refusal_is_told_in_the_units_words(head: Head) -> None:
    await head.ready(speed_rad_s=SPEED)
    with pytest.raises(BehaviourFailed, match=r"PTU_REFUSED .*Illegal command entered: XY"):
        await head.command("XY")


async def test_an_end_hit_on_the_way_is_told(bench: Bench, head: Head) -> None:
    await head.ready(speed_rad_s=SPEED)
    bench.hits = b"!T"
    with pytest.raises(BehaviourFailed, match=r"PTU_LIMIT_HIT .*tilt ran into its end"):
        await head.turn(Aim(0, 0))


async def test_a_head_that_does_not_get_there_is_told(bench: Bench, head: Head) -> None:
    await head.ready(speed_rad_s=math.radians(140))
    bench.is_seized = True
    with pytest.raises(BehaviourFailed, match=r"PTU_STALLED .*did not reach 310, -100"):
        await head.turn(Aim(310, -100))


async def test_no_such_port_is_told() -> None:
    with pytest.raises(BehaviourFailed, match="SERIAL_FAILED /dev/nondum-no-such"):
        SerialLine("/dev/nondum-no-such", BAUD)


async def test_a_pulled_cable_is_told(bench: Bench) -> None:
    with SerialLine(bench.node("head"), BAUD) as line:
        head = Head(line)
        await head.ready(speed_rad_s=SPEED)
        bench.unplug()
        with pytest.raises(BehaviourFailed, match="SERIAL_FAILED"):
            await head.position()
