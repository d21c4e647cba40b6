"""benchmarks/planning counts only right answers, and stops every planner at its time limit."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from benchmarks.planning import __main__ as command
from benchmarks.planning import race, report
from benchmarks.planning.contenders import GAVE_UP, NO_PLAN, PLAN, REFUSED, installed
from benchmarks.planning.problems import Problem, problems_in
from benchmarks.planning.results import Attempt, Results
from tests.kit.endless_problem import ENDLESS, endless
from tests.planning.differential.texts import TEXTS

BY_NAME = {text.name: text for text in TEXTS}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of the shape that is asked for."""
    for name in ("strips", "exhausted", "disjunction"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "domain.pddl").write_text(BY_NAME[name].domain)
        (tmp_path / name / "p01.pddl").write_text(BY_NAME[name].problem)
    (tmp_path / "holes").mkdir()
    (tmp_path / "holes" / "p01-domain.pddl").write_text(ENDLESS)
    (tmp_path / "holes" / "p01-holes.pddl").write_text(endless())
    return tmp_path


def one(folder: Path, name: str) -> Problem:
    return next(problem for problem in problems_in(folder) if problem.group == name)


def tried(problem: str, contender: str, said: str, cost: int = 0, *, valid: bool = True) -> Attempt:
    return Attempt(problem, "roads", contender, said, 0.5, cost=cost, is_valid=valid)


def test_a_problem_has_its_own_domain_or_that_of_its_folder(folder: Path) -> None:
    found = {str(problem): problem.domain.name for problem in problems_in(folder)}
    assert found == {
        "disjunction/p01": "domain.pddl",
        "exhausted/p01": "domain.pddl",
        "holes/p01-holes": "p01-domain.pddl",
        "strips/p01": "domain.pddl",
    }


@pytest.mark.parametrize("contender", installed())
def test_everybody_plans(folder: Path, contender: str) -> None:
    found = race.attempt(one(folder, "strips"), contender, 30.0)
    assert (found.said, found.steps, found.cost, found.is_valid) == (PLAN, 2, 2, True)


@pytest.mark.parametrize("contender", installed())
def test_what_has_no_plan_has_none_for_anybody(folder: Path, contender: str) -> None:
    assert race.attempt(one(folder, "exhausted"), contender, 30.0).said == NO_PLAN


def test_who_does_not_read_a_problem_has_refused_it(folder: Path) -> None:
    found = race.attempt(one(folder, "disjunction"), "pyperplan", 30.0)
    assert found.said == REFUSED
    assert found.why


def test_who_is_killed_at_the_limit_has_given_up(folder: Path) -> None:
    assert race.attempt(one(folder, "holes"), "pyperplan", 1.0).said == GAVE_UP


def test_a_plan_that_does_not_hold_counts_for_nothing() -> None:
    results = Results(
        (tried("a", "native", PLAN, 3), tried("a", "pyperplan", PLAN, 2, valid=False))
    )
    assert results.solved("pyperplan") == set()
    assert results.invalid("pyperplan") == ["a"]
    assert results.dearness("native") == [1.0]


def test_no_plan_is_wrong_where_somebody_has_one() -> None:
    results = Results(
        (
            tried("a", "native", PLAN, 3),
            tried("a", "pyperplan", NO_PLAN),
            tried("b", "native", PLAN, 3, valid=False),
            tried("b", "pyperplan", NO_PLAN),
        )
    )
    assert results.wrong_claims("pyperplan") == ["a"]
    tables = report.as_markdown(results, 10.0, "")
    assert "pyperplan says wrongly that there is no plan: a." in tables
    assert "native has an invalid plan: b." in tables


def test_the_page_is_written(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page.md"
    options = ["--domains", str(folder), "--only", "strips", "--out", str(page)]
    monkeypatch.setattr(sys, "argv", ["planning", *options])
    command.main()
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# Planning problems in files, side by side")
    assert "**native** solved 1 of 1 problems within 10 s each" in text
