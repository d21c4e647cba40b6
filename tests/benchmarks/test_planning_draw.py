"""Problems for planners are drawn by lot, the same ones each time."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.planning import draw

LISTED = ("ferry", "gripper", "hiking-opt14-strips", "hiking-sat14-strips", "tetris-sat14-strips")


@pytest.fixture
def collection(tmp_path: Path) -> Path:
    for name in LISTED:
        pairs = [(f"{name}/domain.pddl", f"{name}/p{number}.pddl") for number in range(9)]
        (tmp_path / name).mkdir()
        (tmp_path / name / "api.py").write_text(f"domains = [\n{{'problems': {pairs!r}}}]\n")
    return tmp_path


def test_the_same_problems_are_drawn_each_time(collection: Path) -> None:
    drawn = list(draw.draw(collection, domains=3))
    assert drawn == list(draw.draw(collection, domains=3))
    assert len(set(drawn)) == 3 * draw.PROBLEMS


def test_no_domain_is_drawn_that_the_planner_was_made_with(collection: Path) -> None:
    names = {problem.partition("/")[0] for _, problem in draw.draw(collection, domains=3)}
    assert names == {"ferry", "hiking-sat14-strips", "tetris-sat14-strips"}
