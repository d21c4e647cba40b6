"""Folders are held to their budget, and only where a machine can be judged."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.runner import budget
from tests.runner.budget import Budget, Spent
from tests.runner.result import Result
from tests.runner.stages import ROOT
from tests.runner.yardstick import Usage, foreign_load

BUDGET = Budget(1.0, {"tests/host": 100.0, "tests/cli": 20.0, "tests/sdk": 4.0}, {})


def passed(test: str, seconds: float) -> Result:
    return Result(test, "passed", seconds)


def test_a_test_counts_for_the_nearest_folder_that_has_a_budget() -> None:
    assert BUDGET.folder_of("tests/cli/test_main.py::test_it") == "tests/cli"
    assert BUDGET.folder_of("tests/host/mind/test_mind.py::test_it") == "tests/host"
    assert BUDGET.folder_of("tests/hostile/test_x.py::test_it") == "tests/hostile"


def test_seconds_of_a_folder_are_those_of_its_tests_and_the_dearest_comes_first() -> None:
    results = [
        passed("tests/sdk/test_a.py::a", 1.0),
        passed("tests/host/test_b.py::b", 2.0),
        passed("tests/host/mind/test_c.py::c[1/2]", 3.0),
    ]
    assert budget.spent(BUDGET, results, slower=1.0) == (
        Spent("tests/host", 2, 5.0, 100.0),
        Spent("tests/sdk", 1, 1.0, 4.0),
    )


def test_seconds_of_a_slower_machine_are_told_as_those_of_the_machine_of_the_budgets() -> None:
    results = [passed("tests/sdk/test_a.py::a", 6.0)]
    assert budget.spent(BUDGET, results, slower=1.25) == (Spent("tests/sdk", 1, 4.8, 4.0),)


@pytest.mark.parametrize(
    ("seconds", "allowed", "is_beyond"),
    [
        (150.0, 100.0, False),
        (151.0, 100.0, True),
        (8.9, 4.0, False),  # a few seconds are spared
        (9.1, 4.0, True),
        (0.1, None, True),  # a folder without a budget is named until it has one
    ],
)
def test_folder_is_beyond_its_budget_at_half_as_much_again(
    seconds: float, allowed: float | None, is_beyond: bool
) -> None:
    assert Spent("tests/x", 1, seconds, allowed).is_beyond is is_beyond


def test_foreign_load_is_what_neither_was_idle_nor_went_to_the_run() -> None:
    before = Usage(at_s=0.0, busy_s=100.0, own_s=1.0)
    after = Usage(at_s=10.0, busy_s=118.0, own_s=16.0)  # of 20 s on two processors: 18 busy, 15 own
    assert foreign_load(before, after, processors=2) == pytest.approx(0.15)


def test_every_budget_is_of_a_folder_that_is_there() -> None:
    known = budget.read()
    places = [*known.folders, *known.slow_files]
    assert [place for place in places if not (ROOT / place).exists()] == []


def test_every_test_file_has_a_budget() -> None:
    known = budget.read()
    files = [*ROOT.glob("tests/**/test_*.py"), *ROOT.glob("plugins/*/tests/test_*.py")]
    names = [str(file.relative_to(ROOT)) for file in files if "data" not in file.parts]
    assert {known.folder_of(name) for name in names} <= set(known.folders), Path(budget.FILE).name


def test_mistake_in_the_file_is_told_with_file_and_line(tmp_path: Path) -> None:
    file = tmp_path / "budget.toml"
    file.write_text("yardstick_s = 1.0\nfolders = [\n")
    with pytest.raises(SystemExit, match=rf"{file}: .*") as ended:
        budget.read(file)
    assert ended.value.code not in (0, None)
