"""Fast Downward answers in nondum's words, in time, and no more is made of it than it says.

What it does itself is tested with a real one, where a wheel has it; how it may end, with programs
that end so.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from nondum.sdk.planner import (
    AlreadyTrue,
    GaveUp,
    PddlTask,
    PlanText,
    TextPlanner,
    Unsolvable,
)
from nondum_planner_fast_downward import FastDownwardPlanner
from nondum_planner_fast_downward.engine import Engine, find_engine

DOMAIN = """(define (domain roads)
  (:constants a c)
  (:predicates (at ?x) (road ?x ?y) (reached ?x) (seen ?x) (done))
  {rules}
  (:action front-eye.go :parameters (?x ?y) :precondition (and (at ?x) (road ?x ?y))
    :effect (and (at ?y) (not (at ?x)) (when (at a) (seen ?x))))
  (:action rest :parameters () :precondition (at c) :effect (done)))
"""
RULE = "(:derived (reached ?y) (or (at ?y) (exists (?x) (and (reached ?x) (road ?x ?y)))))"
PROBLEM = """(define (problem map) (:domain roads) (:objects b d)
  (:init (at a) (road a b) (road b c) {roads}) (:goal {goal}))
"""
PATIENCE_S = 30.0

needs_engine = pytest.mark.skipif(
    find_engine() is None and "CI" not in os.environ, reason="no wheel with Fast Downward"
)


def roads(goal: str, roads: str = "", rules: str = "") -> PddlTask:
    return PddlTask(DOMAIN.format(rules=rules), PROBLEM.format(goal=goal, roads=roads))


def program(script: str) -> tuple[str, ...]:
    """A program of a few lines of Python."""
    return (sys.executable, "-c", script)


def ending(search: str, translate: str = "open('output.sas', 'w').close()") -> Engine:
    """An engine whose programs do no more than that."""
    return Engine(program(translate), program(search))


def test_it_is_found_by_its_entry_point() -> None:
    (entry,) = entry_points(group="nondum.planners", name="fast-downward")
    planner = entry.load()()
    assert isinstance(planner, TextPlanner)
    assert planner.speaks == "pddl"
    assert planner.handles == {"conditional-effects", "derived-predicates"}


@needs_engine
def test_a_plan_by_the_names_of_the_task() -> None:
    answer = FastDownwardPlanner().plan(roads("(and (done) (seen a))"), PATIENCE_S)
    assert answer == PlanText(("front-eye.go a b", "front-eye.go b c", "rest"))


@needs_engine
def test_derived_predicates_are_its_own_affair() -> None:
    answer = FastDownwardPlanner().plan(roads("(and (done) (reached c))", rules=RULE), PATIENCE_S)
    assert isinstance(answer, PlanText)


@needs_engine
def test_what_is_true_already() -> None:
    assert FastDownwardPlanner().plan(roads("(at a)"), PATIENCE_S) == AlreadyTrue()


@needs_engine
@pytest.mark.parametrize("goal", ["(at d)", "(and (at b) (at c))"], ids=["cut off", "torn"])
def test_what_it_proves_to_have_no_plan(goal: str) -> None:
    answer = FastDownwardPlanner().plan(roads(goal), PATIENCE_S)
    assert answer == Unsolvable("exhausted")


def test_no_proof_where_its_heuristics_are_not_safe() -> None:
    translates = "open('output.sas', 'w').write('begin_rule')"
    engine = ending("raise SystemExit(11)", translate=translates)
    answer = FastDownwardPlanner(engine).plan(roads("(done)"), PATIENCE_S)
    assert answer == GaveUp(
        "it found nothing, but is not sure to see everything where there are axioms"
    )


@needs_engine
def test_text_that_it_cannot_read_is_told_in_its_words() -> None:
    answer = FastDownwardPlanner().plan(PddlTask("(define", "(define"), PATIENCE_S)
    assert isinstance(answer, GaveUp)
    assert answer.why.startswith("it ended with 31, and last said: ")


@needs_engine
def test_nothing_is_left_in_the_temporary_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert isinstance(FastDownwardPlanner().plan(roads("(done)"), PATIENCE_S), PlanText)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("code", [12, 20, 21, 22, 23, 24])
def test_out_of_something_is_no_proof(code: int) -> None:
    planner = FastDownwardPlanner(ending(f"raise SystemExit({code})"))
    answer = planner.plan(roads("(done)"), PATIENCE_S)
    assert isinstance(answer, GaveUp)
    assert "last said" not in answer.why


def test_a_crash_is_told_with_its_last_words() -> None:
    crash = "import os; print('no such option', flush=True); os.kill(os.getpid(), 11)"
    answer = FastDownwardPlanner(ending(crash)).plan(roads("(done)"), PATIENCE_S)
    assert answer == GaveUp("it ended by signal 11, and last said: no such option")


def test_a_translator_that_fails_is_not_followed_by_a_search() -> None:
    engine = ending("open('plan', 'w').write('(rest)')", translate="raise SystemExit(30)")
    answer = FastDownwardPlanner(engine).plan(roads("(done)"), PATIENCE_S)
    assert answer == GaveUp("it ended with 30, and last said: nothing")


def test_what_kstar_adds_to_a_plan_is_no_step() -> None:
    engine = ending("open('plan', 'w').write('(rest)\\n(__extra_goal_operator )\\n; cost = 1')")
    assert FastDownwardPlanner(engine).plan(roads("(done)"), PATIENCE_S) == PlanText(("rest",))


@pytest.mark.parametrize("part", ["translate", "search"])
def test_who_overruns_is_killed(part: str, tmp_path: Path) -> None:
    pid = tmp_path / "pid"
    tells = f"import os, signal; open({str(pid)!r}, 'w').write(str(os.getpid()))"
    hangs = f"{tells}; signal.pause()"
    engine = ending(hangs) if part == "search" else ending("", translate=hangs)
    answer = FastDownwardPlanner(engine).plan(roads("(done)"), 5.0)
    assert answer == GaveUp("no plan within 5 s")
    assert not Path(f"/proc/{pid.read_text()}").exists()


def test_it_dies_with_the_process_that_asked(tmp_path: Path) -> None:
    fifo = tmp_path / "alive"
    os.mkfifo(fifo)
    asks = f"""
from nondum.sdk.planner import PddlTask
from nondum_planner_fast_downward import FastDownwardPlanner
from nondum_planner_fast_downward.engine import Engine
import sys
hangs = (sys.executable, "-c", "import time; f = open({str(fifo)!r}, 'w'); time.sleep(60)")
FastDownwardPlanner(Engine(hangs, hangs)).plan(PddlTask("", ""), 60.0)
"""
    # The fifo opens once the program has opened it, and ends once that is gone.
    with subprocess.Popen([sys.executable, "-c", asks]) as asking, fifo.open() as alive:
        asking.send_signal(signal.SIGKILL)
        assert alive.read() == ""


def test_memory_is_limited(tmp_path: Path) -> None:
    limit = tmp_path / "limit"
    asks = "import resource as r; said = str(r.getrlimit(r.RLIMIT_AS))"
    engine = ending(f"{asks}; open({str(limit)!r}, 'w').write(said)")
    answer = FastDownwardPlanner(engine).plan(roads("(done)"), PATIENCE_S)
    assert answer == GaveUp("it says that it has a plan, and there is none")
    assert limit.read_text() == f"({4096 * 2**20}, {4096 * 2**20})"


def test_without_an_engine_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [])
    answer = FastDownwardPlanner().plan(roads("(done)"), PATIENCE_S)
    assert answer == GaveUp("no Fast Downward is installed: pip install up-fast-downward")


@pytest.mark.parametrize(
    ("package", "inside", "plan"),
    [
        ("up_fast_downward", "downward/builds/release/bin", "plan"),
        ("kstar_planner", "builds/release/bin", "found_plans/plan"),
    ],
)
def test_an_engine_is_found_without_importing_its_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, inside: str, plan: str
) -> None:
    builds = tmp_path / package / inside
    builds.mkdir(parents=True)
    (builds / "downward").touch()
    (tmp_path / package / "__init__.py").write_text("raise AssertionError('imported')")
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    found = find_engine()
    assert found is not None
    assert found.search[0] == str(builds / "downward")
    assert found.plan == plan


def test_a_wheel_without_the_program_is_no_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "kstar_planner").mkdir()
    (tmp_path / "kstar_planner" / "__init__.py").touch()
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    assert find_engine() is None
