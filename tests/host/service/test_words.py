"""The status text of the service: one line that says what the robot does and needs."""

from __future__ import annotations

from pathlib import Path

from nondum.host.core.records import DriveRecord, DriveState, Moment, Safety, Snapshot
from nondum.host.service.words import words
from nondum.sdk.errors import Problem


def drive(*problems: Problem, id: str = "sda1") -> DriveRecord:
    return DriveRecord(
        id=id,
        kind="block",
        root=Path("/mnt"),
        since=Moment(0, 0),
        state=DriveState.IDLE,
        problems=problems,
    )


def told(*drives: DriveRecord, goals: tuple[dict[str, str], ...] = (), **more: object) -> str:
    safety = more.get("safety", Safety.OFF)
    assert isinstance(safety, Safety)
    return words(Snapshot("spot", 1, drives=drives, safety=safety), goals, {})


def test_host_with_nothing_says_so() -> None:
    assert told() == "0 components at work"


def test_goals_are_told_by_what_becomes_of_them() -> None:
    goals = (
        {"state": "active", "text": "follow me"},
        {"state": "suspended", "text": "point at it"},
        {"state": "reached", "text": "was long ago"},
    )
    assert told(goals=goals) == ("0 components at work; does: follow me; cannot yet: point at it")


def test_first_problem_is_told_and_the_rest_is_counted() -> None:
    full = Problem("DISK_FULL", "the disk is full", fix="free some")
    assert "needs help: DISK_FULL the disk is full → free some" in told(drive(full))
    assert told(drive(full), drive(full, id="sdb1")).endswith("(and 1 more)")


def test_safe_mode_comes_first() -> None:
    assert told(safety=Safety.INITIAL).startswith("safe mode; ")


def test_words_of_strangers_stay_on_the_line() -> None:
    goals = ({"state": "active", "text": "a\nb\x1b[31m"},)
    assert "\n" not in told(goals=goals)
    assert "\x1b" not in told(goals=goals)
