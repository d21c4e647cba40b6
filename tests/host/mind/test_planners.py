"""Planner processes: warm, bounded, and believed only after a check."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
from tests.planning.tasks import FOLLOW_PLAN, follow_task, gripper_task, plan_of

from nondum.host.mind.planner_process import PlannerProcess
from nondum.host.mind.planners import Planners
from nondum.sdk.errors import PlannerFailed
from nondum.sdk.planner import AlreadyTrue, GaveUp, GroundTask, Plan, Unsolvable

pytestmark = pytest.mark.anyio

SHAM = """
import os, time
from nondum.sdk.planner import AlreadyTrue, GaveUp, Plan, Unsolvable
class Planner:
    speaks = "ground"
class Liar(Planner):
    def plan(self, task, deadline_s): return Plan((0,), 1)
class Prover(Planner):
    def plan(self, task, deadline_s): return Unsolvable("trust me")
class Blind(Planner):
    def plan(self, task, deadline_s): return AlreadyTrue()
class Hanger(Planner):
    def plan(self, task, deadline_s): time.sleep(3600)
class Raiser(Planner):
    def plan(self, task, deadline_s): print("psst"); raise ValueError("no idea")
class Dier(Planner):
    def plan(self, task, deadline_s): os._exit(3)
class Babbler(Planner):
    def plan(self, task, deadline_s): return "a plan"
class Glutton(Planner):
    def plan(self, task, deadline_s): return len(bytearray(10**10))
class Stranger(Planner):
    speaks = "esperanto"
"""

Make = Callable[[str], PlannerProcess]


@pytest.fixture
async def planner(tmp_path: Path) -> AsyncIterator[Make]:
    """Makes planner processes, also of planners that misbehave."""
    (tmp_path / "sham.py").write_text(SHAM)
    info = tmp_path / "sham-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: sham\nVersion: 1\n")
    names = [line.split("(")[0].split()[1] for line in SHAM.splitlines() if "(Planner)" in line]
    entries = "\n".join(f"{name.lower()} = sham:{name}" for name in names)
    (info / "entry_points.txt").write_text(f"[nondum.planners]\n{entries}\n")
    paths = [str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]
    made: list[PlannerProcess] = []

    def make(name: str) -> PlannerProcess:
        environment = {"PYTHONPATH": os.pathsep.join(paths)}
        made.append(PlannerProcess(name, memory_mb=512, environment=environment))
        return made[-1]

    yield make
    for process in made:
        await process.close()


@pytest.fixture
def task() -> GroundTask:
    return gripper_task(1)


async def test_installed_planner_finds_a_plan(planner: Make, task: GroundTask) -> None:
    found = await Planners([planner("pyperplan")]).plan(task, 5.0)
    assert found.answer == plan_of(task, "pick ball0 a", "move a b", "drop ball0 b")
    assert found.planner == "pyperplan"


async def test_child_stays_warm(planner: Make, task: GroundTask) -> None:
    process = planner("pyperplan")
    await process.warm()
    pid = process.pid
    await process.plan(task, 5.0)
    await process.plan(task, 5.0)
    assert process.pid == pid is not None


async def test_true_goal_needs_no_planner(planner: Make, task: GroundTask) -> None:
    done = GroundTask(task.facts, task.goal, task.goal, task.actions)
    assert (await Planners([]).plan(done, 5.0)).answer == AlreadyTrue()


async def test_unreachable_goal_is_proved_without_planner() -> None:
    task = follow_task()
    ready = task.facts.index("ready base")
    blocked = GroundTask(task.facts, task.init - {ready}, task.goal, task.actions)
    answer = (await Planners([]).plan(blocked, 5.0)).answer
    assert answer == Unsolvable("relaxed", ("following r",))


async def test_no_planner_is_no_proof(task: GroundTask) -> None:
    found = await Planners([]).plan(task, 5.0)
    assert found.answer == GaveUp("no planner is installed")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("liar", "its plan is not valid"),
        ("prover", "it claims a proof that does not hold"),
        ("blind", "it says that the goal holds, which it does not"),
        ("hanger", "it overran its deadline of 0.1 s and was killed"),
        ("raiser", "PLANNER_RAISED ValueError: no idea"),
        ("dier", "PLANNER_DIED planner dier: it ended without an answer"),
        ("babbler", "PLANNER_RAISED TypeError: a planner answers with"),
        ("glutton", "it ran out of memory"),
        ("stranger", "PLANNER_START planner stranger: it speaks no language of this host"),
        ("nobody", "PLANNER_START planner nobody: it does not start"),
    ],
)
async def test_misbehaving_planner_gave_up(
    planner: Make, task: GroundTask, name: str, why: str
) -> None:
    found = await Planners([planner(name)]).plan(task, 0.1)
    assert isinstance(found.answer, GaveUp)
    assert why in found.answer.why


async def test_first_valid_plan_wins(planner: Make, task: GroundTask) -> None:
    planners = Planners([planner("hanger"), planner("liar"), planner("pyperplan")])
    found = await planners.plan(task, 20.0)
    assert isinstance(found.answer, Plan)
    assert found.planner == "pyperplan"


async def test_killed_planner_comes_back(planner: Make, task: GroundTask) -> None:
    process = planner("pyperplan")
    await process.warm()
    assert process.pid is not None
    os.kill(process.pid, 9)
    with pytest.raises(PlannerFailed):
        await process.plan(task, 5.0)
    assert isinstance(await process.plan(task, 5.0), Plan)


async def test_cancelling_kills_the_search(planner: Make, task: GroundTask) -> None:
    process = planner("hanger")
    await process.warm()
    pid = process.pid
    search = asyncio.create_task(process.plan(task, 60.0))
    await asyncio.sleep(0)
    search.cancel()
    with pytest.raises(asyncio.CancelledError):
        await search
    assert pid is not None
    assert process.pid is None
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


async def test_follow_plan_is_the_only_one(planner: Make) -> None:
    task = follow_task()
    found = await Planners([planner("pyperplan")]).plan(task, 5.0)
    assert isinstance(found.answer, Plan)
    names = [task.actions[step].name for step in found.answer.steps]
    assert [name.split(" ")[0] for name in names] == [n.split(" ")[0] for n in FOLLOW_PLAN]
