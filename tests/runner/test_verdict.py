"""What makes a run fail, and what its last lines say."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.runner import hardware
from tests.runner.budget import Spent
from tests.runner.hardware import KnownSkip
from tests.runner.job import Done, Job
from tests.runner.result import Result
from tests.runner.verdict import Findings

GOOD = Result("tests/a.py::good", "passed", 1.0)
BAD = tuple(Result(f"tests/a.py::bad{n}", "failed", 1.0, f"/t/bad{n}", "", "why") for n in range(4))
SKIPPED = Result("tests/a.py::needs[root-1]", "skipped", 0.0, reason="needs root")
SLOW = Spent("tests/a", 2, 20.0, 10.0)
DIED = Done(Job("lab", ("./run",), Path("/"), Path("/t/lab.log")), 1, 1.0, ())


def last(found: Findings) -> str:
    return list(found.lines("/t"))[-1]


@pytest.mark.parametrize(
    ("found", "is_green", "end"),
    [
        (Findings((GOOD, SKIPPED)), True, "1 passed, 0 failed, 1 skipped"),
        (Findings((GOOD, BAD[0])), False, "1 passed, 1 failed, 0 skipped"),
        (Findings((GOOD,), died=(DIED,)), False, "1 passed, 1 failed, 0 skipped"),
        (Findings((GOOD,), folders=(SLOW,)), True, "1 passed, 0 failed, 0 skipped"),
        (
            Findings((GOOD,), folders=(SLOW,), is_judged=True),
            False,
            "1 passed, 1 failed, 0 skipped",
        ),
        (
            Findings((GOOD, SKIPPED), refused_skips=(SKIPPED,)),
            False,
            "1 passed, 1 failed, 1 skipped",
        ),
        (
            Findings((GOOD, *BAD[:3]), passed_alone=BAD[:3]),
            True,
            "4 passed, 0 failed, 0 skipped",
        ),
        (Findings((GOOD, *BAD), passed_alone=BAD), False, "1 passed, 4 failed, 0 skipped"),
        (
            Findings((GOOD, *BAD[:2]), passed_alone=BAD[:1]),
            False,
            "2 passed, 1 failed, 0 skipped",
        ),
    ],
)
def test_run_is_green_only_if_nothing_failed_for_good(
    found: Findings, is_green: bool, end: str
) -> None:
    assert (found.is_green, last(found)) == (is_green, end)


def test_each_failure_is_told_again_with_its_folder() -> None:
    lines = list(Findings((GOOD, BAD[0])).lines("/t"))
    assert f"FAILED {BAD[0].test}" in lines
    assert f"folder: {BAD[0].folder}" in lines


def test_unstable_tests_are_named_with_their_evidence() -> None:
    lines = list(Findings((BAD[0],), passed_alone=BAD[:1]).lines("/t"))
    assert f"UNSTABLE {BAD[0].test} (evidence: {BAD[0].folder})" in lines


def test_skip_is_known_by_its_node_id_brackets_and_all() -> None:
    known = [KnownSkip("tests/a.py::needs[root-*", "root", "no substitute")]
    other = Result("tests/a.py::needs[loop-1]", "skipped", 0.0, reason="no loop devices")
    assert hardware.unknown([SKIPPED, other], known) == (other,)


def test_every_known_skip_says_what_is_missing() -> None:
    assert all(skip.test and skip.missing and skip.reason for skip in hardware.read())
