"""Which tests a session has, and what it keeps and writes down of each."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.runner import chosen, job, stages
from tests.runner.result import Result

INI = """
[pytest]
addopts = -p no:hypothesispytest
markers =
    long(campaign): of a campaign
    short(campaign): of a campaign
tmp_path_retention_policy = failed
"""
"""Hypothesis is what takes longest to import, and no test here uses it."""
TESTS = """
import os, pytest

def test_always(tmp_path):
    (tmp_path / "file").touch()

@pytest.mark.long("storms")
def test_long(): pass

@pytest.mark.short("storms")
def test_short(): pass

@pytest.mark.skipif(True, reason="no wind here")
def test_skipped(): pass

def test_failing(tmp_path, seed):
    (tmp_path / "evidence").write_text(str(seed))
    assert False
"""
DIES = """
import os

def test_that_ends_its_process():
    os._exit(3)
"""


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    folder = tmp_path / "checkout"
    folder.mkdir()
    (folder / "pytest.ini").write_text(INI)
    (folder / "test_it.py").write_text(TESTS)
    return folder


def run(checkout: Path, *options: str) -> dict[str, Result]:
    of = stages.pytest_job("session", checkout.parent, (*options, "."), folder=checkout)
    return {one.test.split("::")[1]: one for one in job.run(of).results}


def test_full_run_has_short_forms_and_no_long_ones(checkout: Path) -> None:
    results = run(checkout)
    assert set(results) == {"test_always", "test_short", "test_skipped", "test_failing"}
    assert results["test_skipped"].reason == "no wind here"


def test_short_form_of_a_current_campaign_is_left_out(checkout: Path) -> None:
    assert "test_short" not in run(checkout, "--current", "calms,storms")
    assert "test_short" in run(checkout, "--current", "calms")


def test_campaign_has_its_own_tests_only(checkout: Path) -> None:
    assert set(run(checkout, "--campaign", "storms")) == {"test_long", "test_short"}


@pytest.mark.parametrize("options", [(), ("-n", "1")])
def test_folder_of_a_test_is_kept_if_it_failed(checkout: Path, options: tuple[str, ...]) -> None:
    results = run(checkout, "--seed", "7", *options)
    kept = Path(results["test_failing"].folder)
    assert (kept / "evidence").read_text() == "7"
    assert [path.parent for path in checkout.parent.glob("session/**/evidence")] == [kept]
    assert not list(checkout.parent.glob("session/**/file"))


def test_session_that_dies_is_no_success(checkout: Path) -> None:
    (checkout / "test_it.py").write_text(DIES)
    of = stages.pytest_job("session", checkout.parent, (".",), folder=checkout)
    done = job.run(of)
    assert done.failed_itself
    assert (done.status, done.results) == (3, ())


def test_dead_process_of_several_is_a_failed_test(checkout: Path) -> None:
    (checkout / "test_it.py").write_text(DIES)
    (one,) = run(checkout, "-n", "1").values()
    assert (one.test, one.outcome) == ("test_it.py::test_that_ends_its_process", "failed")


def test_tests_that_run_alone_are_looked_for_where_they_are_asked_for() -> None:
    assert chosen.has_alone(["tests/demo", "-x"])
    assert chosen.has_alone(["-k", "nothing"])
    assert not chosen.has_alone(["tests/planning", "-k", "alone"])
