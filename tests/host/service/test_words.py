"""The status text of the service: one line that says what the robot does and needs."""

from __future__ import annotations

from pathlib import Path

from tests.kit.golden import Golden

from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
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


def test_host_with_nothing_says_so(golden: Golden) -> None:
    golden.check("nothing is plugged in", told())


def test_goals_are_told_by_what_becomes_of_them(golden: Golden) -> None:
    goals = (
        {"state": "active", "text": "follow me"},
        {"state": "suspended", "text": "point at it"},
        {"state": "reached", "text": "was long ago"},
    )
    golden.check("one goal is active, one suspended", told(goals=goals))


def test_first_problem_is_told_and_the_rest_is_counted(golden: Golden) -> None:
    full = Problem("DISK_FULL", "the disk is full", fix="free some")
    golden.check("a drive has a problem", told(drive(full)), problem=full)
    two = told(drive(full), drive(full, id="sdb1"))
    golden.check("two drives have problems", two, problem=full)


def test_safe_mode_comes_first(golden: Golden) -> None:
    golden.check("safe mode", told(safety=Safety.INITIAL))


def test_words_of_strangers_stay_on_the_line() -> None:
    goals = ({"state": "active", "text": "a\nb\x1b[31m"},)
    assert "\n" not in told(goals=goals)
    assert "\x1b" not in told(goals=goals)
