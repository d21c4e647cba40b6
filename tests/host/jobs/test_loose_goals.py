"""Goals outside every signature are told of, wherever people put them, and never opened."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from nondum.host.jobs.loose_goals import PLACES, loose_goals


@pytest.mark.parametrize("place", PLACES)
def test_a_loose_goal_is_told_of_by_its_place(tmp_path: Path, place: str) -> None:
    (tmp_path / place).parent.mkdir(exist_ok=True)
    os.mkfifo(tmp_path / place)  # a process that opens it waits for ever
    [problem] = loose_goals(tmp_path)
    assert (problem.code, problem.where) == ("GOAL_UNSIGNED", place)


def test_a_drive_without_one_is_not_spoken_of(tmp_path: Path) -> None:
    (tmp_path / "nondum/org.example.delivery").mkdir(parents=True)
    (tmp_path / "nondum/org.example.delivery/goal.txt").write_text("go\n")
    assert list(loose_goals(tmp_path)) == []
