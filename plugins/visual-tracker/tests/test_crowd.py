"""Everybody in sight."""

from __future__ import annotations

import math
from collections.abc import Sequence

from nondum_visual_tracker.crowd import Crowd
from nondum_visual_tracker.sighting import Sighting

PERIOD_S = 0.2


def sights(*azimuths_deg: float) -> list[Sighting]:
    return [Sighting(math.radians(azimuth), 0.3) for azimuth in azimuths_deg]


def watched(images: Sequence[Sequence[float]], ahead_deg: float = 0.0) -> Crowd:
    """The crowd after images, one period apart, with azimuths in degrees; somebody is picked."""
    crowd = Crowd(memory_s=1.5)
    for step, image in enumerate(images):
        crowd = crowd.seen(sights(*image), step * PERIOD_S).picked(math.radians(ahead_deg))
    return crowd


def target_deg(crowd: Crowd) -> float | None:
    return math.degrees(crowd.target.azimuth) if crowd.target else None


def test_person_nearest_ahead_is_picked() -> None:
    found = target_deg(watched([[-20, 3, 15]] * 3))
    assert found is not None
    assert abs(found - 3) < 0.5


def test_flicker_is_not_taken_for_a_person() -> None:
    assert watched([[10], [0, 10], [10]]).target == watched([[10], [10], [10]]).target
    assert watched([[0]]).target is None


def test_choice_lasts_when_somebody_comes_nearer() -> None:
    found = target_deg(watched([[10]] * 4 + [[10, 0]] * 4))
    assert found is not None
    assert abs(found - 10) < 1


def test_identity_lasts_over_a_second_without_sight() -> None:
    walk = [[2.0 * step, -30] for step in range(10)]
    gap = [[-30.0]] * 5
    after = [[26 + 2.0 * step, -30] for step in range(4)]
    crowd = watched([*walk, *gap, *after])
    found = target_deg(crowd)
    assert found is not None
    assert abs(found - 32) < 2
    assert crowd.target is not None
    assert crowd.target.hits > 10


def test_people_who_cross_are_not_swapped() -> None:
    images = [[-14.0 + 2 * step, 14.0 - 2 * step] for step in range(15)]
    found = target_deg(watched(images, ahead_deg=-14))
    assert found is not None
    assert abs(found - 14) < 2


def test_lost_person_is_forgotten_in_the_end() -> None:
    crowd = watched([[0.0]] * 5 + [[60.0]] * 12)
    found = target_deg(crowd)
    assert found is not None
    assert abs(found - 60) < 1


def test_old_images_are_ignored() -> None:
    crowd = watched([[0.0]] * 5)
    assert crowd.seen(sights(30), 0.1) is crowd


def test_ghost_does_not_take_a_living_persons_sighting() -> None:
    """Somebody vanishes on the way to the other, who then moves as the vanished one would."""
    images = [[0, 20], [0, 15], [0, 10], [0, 5], [0], [-1], [-2], [-2]]
    crowd = watched(images)
    assert crowd.target is not None
    assert crowd.target.hits == len(images)
