"""Following, closed loop, on real images: who follows passes the check, who does not fails it."""

from __future__ import annotations

import pytest
from demo.following import WANTED_FRACTION, Reference, score_following
from tests.demo.robot_in_simulated_time import CLIP, Obedience, Robot

SECONDS = 21.0
"""Three of standing still, and more than one whole walk to and fro."""


@pytest.fixture(scope="module")
def reference() -> Reference:
    return Reference.read(CLIP.video.with_suffix(".toml"))


def score(robot: Robot, reference: Reference) -> float:
    robot.run(SECONDS)
    return score_following(robot.headings, robot.frames, reference)


long = pytest.mark.long("demonstrations")


@pytest.mark.parametrize(
    ("kind", "latency_s"),
    [
        *(("colour", 0.1), ("colour", 0.4), ("thermal", 0.25)),
        *(pytest.param("colour", 0.25, marks=long), pytest.param("thermal", 0.1, marks=long)),
        pytest.param("thermal", 0.4, marks=long),
    ],
)
def test_follower_passes(kind: str, latency_s: float, reference: Reference) -> None:
    assert score(Robot(kind, latency_s), reference) >= WANTED_FRACTION


@pytest.mark.parametrize("kind", ["colour", "thermal"])
def test_follower_passes_with_another_detector(kind: str, reference: Reference) -> None:
    assert score(Robot(kind, detects="pedestrians"), reference) >= WANTED_FRACTION


def test_follower_passes_without_odometry(reference: Reference) -> None:
    assert score(Robot(has_odometry=False), reference) >= WANTED_FRACTION


def test_follower_passes_when_it_begins_late(reference: Reference) -> None:
    assert score(Robot(begins_s=3.0), reference) >= WANTED_FRACTION


@pytest.mark.parametrize(
    "obedience",
    [lambda turn: 0.0, lambda turn: -turn, lambda turn: 0.4],
    ids=["frozen", "inverted", "spinning"],
)
@pytest.mark.parametrize("walks", [1, pytest.param(2, marks=long)])
def test_body_that_does_not_follow_fails_in_every_window(
    obedience: Obedience, walks: int, reference: Reference
) -> None:
    """The demonstration takes the first window that passes, so none may."""
    robot = Robot(obedience=obedience)
    robot.run(walks * SECONDS)
    ends = range(1, len(robot.frames) + 1, 5)
    shares = [score_following(robot.headings, robot.frames[:end], reference) for end in ends]
    assert max(shares) < WANTED_FRACTION
