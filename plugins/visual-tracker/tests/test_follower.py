"""The follower and its control law, on a body that does as it is told."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from nondum_visual_tracker.controller import Gains, Mode
from nondum_visual_tracker.follower import Follower
from nondum_visual_tracker.sighting import Sighting, range_by_height

PERIOD_S = 0.05
GAINS = Gains()
Walk = Callable[[float], float | None]
"""Time → the person's azimuth in the world; None while unseen."""


class World:
    """A body that turns as told, and a detector that answers every 0.25 s, 0.2 s late."""

    def __init__(self, walk: Walk, *, height: float = 0.3, gains: Gains = GAINS) -> None:
        self.follower = Follower(gains)
        self.heading = self.now_s = 0.0
        self._walk, self._height = walk, height
        self._pending: list[tuple[float, tuple[Sighting, ...], float]] = []
        self.modes: list[Mode] = []
        self.command = self.follower.command(0.0)

    def run(self, seconds: float) -> World:
        for _ in range(round(seconds / PERIOD_S)):
            self._step()
        return self

    def _step(self) -> None:
        if round(self.now_s / PERIOD_S) % 5 == 0:
            self._pending.append((self.now_s + 0.2, self._sights(), self.now_s))
        while self._pending and self._pending[0][0] <= self.now_s:
            _, seen, stamp_s = self._pending.pop(0)
            self.follower.saw(seen, stamp_s)
        self.follower.heading.measured(self.now_s, self.heading)
        self.command = self.follower.command(self.now_s)
        if not self.modes or self.modes[-1] is not self.command.mode:
            self.modes.append(self.command.mode)
        self.heading += self.command.turn_rad_s * PERIOD_S
        self.now_s += PERIOD_S

    def _sights(self) -> tuple[Sighting, ...]:
        azimuth = self._walk(self.now_s)
        if azimuth is None:
            return ()
        return (Sighting(azimuth - self.heading, self._height),)


def test_body_turns_to_a_still_person() -> None:
    world = World(lambda now: 0.4).run(4)
    assert world.heading == pytest.approx(0.4, abs=math.radians(1.5))
    assert abs(world.command.turn_rad_s) < 0.05


@pytest.mark.parametrize("rate", [-0.25, 0.1, 0.25])
def test_body_keeps_up_with_a_walking_person(rate: float) -> None:
    world = World(lambda now: rate * now).run(8)
    assert world.heading == pytest.approx(rate * world.now_s, abs=math.radians(4))


def test_base_stays_still_with_no_one_in_sight() -> None:
    world = World(lambda now: None).run(10)
    assert world.modes == [Mode.ACQUIRING]
    assert world.heading == 0.0


def test_lost_person_is_waited_for_then_searched_the_way_they_went() -> None:
    world = World(lambda now: -0.2 * now if now < 4 else None).run(12)
    assert world.modes == [
        Mode.ACQUIRING,
        Mode.FOLLOWING,
        Mode.COASTING,
        Mode.STOPPED,
        Mode.SEARCHING,
    ]
    assert world.command.turn_rad_s == -GAINS.search_rad_s
    assert world.command.speed_m_s == 0.0


def test_person_who_comes_back_is_followed_again() -> None:
    world = World(lambda now: None if 4 < now < 9 else 0.3).run(14)
    assert world.modes[-1] is Mode.FOLLOWING
    assert world.heading == pytest.approx(0.3, abs=math.radians(2))


def test_gap_of_a_second_stops_nothing() -> None:
    world = World(lambda now: None if 4 < now < 5 else 0.15 * now).run(8)
    assert Mode.STOPPED not in world.modes
    assert world.heading == pytest.approx(0.15 * world.now_s, abs=math.radians(4))


@pytest.mark.parametrize("azimuth", [-3.0, 3.0])
def test_turning_has_a_limit(azimuth: float) -> None:
    world = World(lambda now: azimuth)
    for _ in range(60):
        world.run(PERIOD_S)
        assert abs(world.command.turn_rad_s) <= GAINS.max_turn_rad_s


def height_at(distance_m: float) -> float:
    return 2 * math.atan(GAINS.person_m / 2 / distance_m)


@pytest.mark.parametrize(
    ("distance_m", "speed"),
    [(8.0, GAINS.max_speed_m_s), (2.5, 0.25), (2.0, 0.0), (0.5, -GAINS.max_reverse_m_s)],
)
def test_distance_by_height_is_kept(distance_m: float, speed: float) -> None:
    assert range_by_height(height_at(distance_m), person_m=1.7) == pytest.approx(distance_m)
    world = World(lambda now: 0.0, height=height_at(distance_m)).run(2)
    assert world.command.speed_m_s == pytest.approx(speed, abs=0.02)


def test_body_does_not_drive_where_it_does_not_face() -> None:
    world = World(lambda now: 1.5, height=height_at(8.0))
    world.run(0.6)
    assert world.command.turn_rad_s > 0
    assert world.command.speed_m_s == 0.0
