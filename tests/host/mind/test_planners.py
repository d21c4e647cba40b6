"""Planner processes: begun at once, bounded, and believed only after a check."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left
from tests.kit.processes import is_alive, process_ended
from tests.kit.until import arrived, until_async
from tests.planning.tasks import FOLLOW_PLAN, follow_task, gripper_task, plan_of

from nondum.host.forking.fork_client import REST_S
from nondum.host.mind.planner_process import QUIET_S, PlannerProcess, planner_forks
from nondum.host.mind.planner_wire import Request
from nondum.host.mind.planners import CHEAPER_S, Planners
from nondum.sdk.errors import PlannerFailed
from nondum.sdk.planner import (
    AlreadyTrue,
    ConditionalEffect,
    GaveUp,
    GroundAction,
    GroundTask,
    Layer,
    PddlTask,
    Plan,
    Rule,
    Unsolvable,
)

pytestmark = pytest.mark.anyio

SHAM = """
import os, tempfile, time
from pathlib import Path
with Path(__file__).with_name("imported").open("a") as imported: print(os.getpid(), file=imported)
from nondum.sdk.planner import AlreadyTrue, GaveUp, Plan, PlanText, Unsolvable
class Planner:
    speaks = "ground"
    handles = frozenset()
class Liar(Planner):
    def plan(self, task, deadline_s): return Plan((0,), 1)
class Prover(Planner):
    def plan(self, task, deadline_s): return Unsolvable("trust me")
class Blind(Planner):
    def plan(self, task, deadline_s): return AlreadyTrue()
class Hanger(Planner):
    def plan(self, task, deadline_s): time.sleep(3600)
class Writer(Planner):
    def plan(self, task, deadline_s):
        handle, name = tempfile.mkstemp()
        os.write(handle, b"searched")
        time.sleep(3600)
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
class Spender(Planner):
    def plan(self, task, deadline_s):
        dear = max(range(len(task.actions)), key=lambda index: task.actions[index].cost)
        return Plan((dear,), task.actions[dear].cost)
class Reader(Planner):
    speaks = "pddl"
    def plan(self, task, deadline_s): return PlanText(tuple(task.problem.split(",")))
class Importer(Planner):
    imported_by = os.getpid()
    def plan(self, task, deadline_s):
        return GaveUp({os.getpid(): "its process", os.getppid(): "the server"}[self.imported_by])
class Sceptic(Planner):
    speaks = "pddl"
    def plan(self, task, deadline_s): return Unsolvable("relaxed")
"""

THREADED = """
import os, sham, threading, time
threading.Thread(target=time.sleep, args=(3600,), daemon=True).start()
class Importer(sham.Importer):
    imported_by = os.getpid()
"""

REFERENCES = {
    "native": "nondum.host.mind.native_planner:NativePlanner",
    "pyperplan": "nondum_planner_pyperplan:PyperplanPlanner",
}

Make = Callable[[str], PlannerProcess]


@pytest.fixture
async def planner(tmp_path: Path) -> AsyncIterator[Make]:
    """Makes planner processes, also of planners that misbehave."""
    (tmp_path / "sham.py").write_text(SHAM)
    (tmp_path / "imported").touch()
    (tmp_path / "threaded.py").write_text(THREADED)
    paths = [str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]
    made: list[PlannerProcess] = []
    forks = planner_forks({"PYTHONPATH": os.pathsep.join(paths)})

    def make(name: str) -> PlannerProcess:
        reference = REFERENCES.get(name, name if ":" in name else f"sham:{name.capitalize()}")
        folder = tmp_path / "planning"
        made.append(PlannerProcess(name, reference, forks, memory_mb=512, temporary=folder))
        return made[-1]

    yield make
    for process in made:
        await process.close()
    await forks.close()


@pytest.fixture
def task() -> GroundTask:
    return gripper_task(1)


@pytest.mark.parametrize("name", REFERENCES)
async def test_shipped_planner_finds_a_plan(planner: Make, task: GroundTask, name: str) -> None:
    found = await Planners([planner(name)]).plan(task, 5.0)
    assert found.answer == plan_of(task, "pick ball0 a", "move a b", "drop ball0 b")
    assert found.planner == name


async def test_native_planner_is_installed_with_the_host(task: GroundTask) -> None:
    planners = Planners.installed(memory_mb=512)
    try:
        assert "native" in planners.names
        assert isinstance((await planners.plan(task, 5.0)).answer, Plan)
    finally:
        await planners.close()


async def test_child_stays_for_the_next_task_and_ends_without_one(
    planner: Make, task: GroundTask, clock: VirtualClock
) -> None:
    process = planner("pyperplan")
    await process.plan(Request(task), 5.0)
    pid = process.pid
    await clock.advance(0.9 * QUIET_S)
    await process.plan(Request(task), 5.0)
    assert process.pid == pid is not None
    await clock.advance(0.9 * QUIET_S)
    assert process.pid == pid
    with process_ended(pid) as ended:
        await clock.advance(0.2 * QUIET_S)
        await ended.wait()
    assert isinstance(await process.plan(Request(task), 5.0), Plan)


async def test_fork_server_that_does_not_stay_ends_after_the_last_planner(
    clock: VirtualClock, task: GroundTask
) -> None:
    forks = planner_forks(stays=lambda: False)
    process = PlannerProcess(
        "native", "nondum.host.mind.native_planner:NativePlanner", forks, memory_mb=512
    )
    try:
        planners = Planners([process], forks)
        await planners.warm()
        assert forks.pid is None
        await process.plan(Request(task), 5.0)
        assert forks.pid is not None
        with process_ended(forks.pid) as ended:
            await clock.advance(1.1 * QUIET_S)
            await clock.advance_until(ended.wait(), REST_S)
        assert isinstance(await process.plan(Request(task), 5.0), Plan)
    finally:
        await process.close()
        await forks.close()


@pytest.mark.parametrize(
    ("name", "imports", "who"),
    [("sham", 2, "the server"), ("threaded", 1, "its process")],  # one is the server's trial
)
async def test_planner_is_imported_by_the_fork_server_where_that_leaves_it_fit_to_fork(
    planner: Make, task: GroundTask, tmp_path: Path, name: str, imports: int, who: str
) -> None:
    process, imported = planner(f"{name}:Importer"), tmp_path / "imported"
    await process.warm()
    await until_async("imports", lambda: len(imported.read_text().splitlines()) == imports)
    assert await process.plan(Request(task), 5.0) == GaveUp(who)


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
        ("absent", "PLANNER_START planner absent: it does not start"),
    ],
)
async def test_misbehaving_planner_gave_up(
    planner: Make, task: GroundTask, clock: VirtualClock, name: str, why: str
) -> None:
    process = planner(name)
    planning = asyncio.create_task(Planners([process]).plan(task, 0.1))
    if name == "hanger":  # only this one is judged by time: of a child that runs
        await until_async("a child", lambda: process.pid)
        await clock.advance_until(planning)
    found = await arrived("an answer", planning)
    assert isinstance(found.answer, GaveUp)
    assert why in found.answer.why


async def test_what_a_planner_had_written_goes_when_it_is_killed(
    planner: Make, task: GroundTask, tmp_path: Path
) -> None:
    process, folder = planner("writer"), tmp_path / "planning/writer"
    searching = asyncio.create_task(process.plan(Request(task), 3600.0))
    await until_async("its file", lambda: folder.is_dir() and any(folder.iterdir()))
    searching.cancel()
    await asyncio.wait([searching])
    assert not folder.exists()


async def test_start_that_is_cancelled_leaves_nothing(
    planner: Make, task: GroundTask, tmp_path: Path
) -> None:
    process, folder = planner("native"), tmp_path / "planning/native"
    await cancelled_in_the_midst_of_making_its_folder(process, task, folder)
    await process.close()
    assert not (await asyncio.to_thread(list, (tmp_path / "planning").iterdir()))


async def test_start_after_one_that_was_cancelled_has_its_folder(
    planner: Make, task: GroundTask, tmp_path: Path
) -> None:
    process, folder = planner("native"), tmp_path / "planning/native"
    await cancelled_in_the_midst_of_making_its_folder(process, task, folder)
    await process.plan(Request(task), 5.0)
    assert await asyncio.to_thread(folder.is_dir)
    assert not await asyncio.to_thread(list, folder.glob("left-*"))


async def cancelled_in_the_midst_of_making_its_folder(
    process: PlannerProcess, task: GroundTask, folder: Path
) -> None:
    """Cancel a start while it removes what a planner before has left."""

    def leave_much() -> None:
        folder.mkdir(parents=True)
        for number in range(2_000):
            (folder / f"left-{number}").touch()

    def is_untouched() -> bool:
        return sum(1 for _ in folder.iterdir()) == 2_000

    await asyncio.to_thread(leave_much)
    starting = asyncio.create_task(process.plan(Request(task), 5.0))
    while is_untouched():  # noqa: ASYNC110  # nothing tells of it
        await asyncio.sleep(0)
    starting.cancel()
    await asyncio.wait([starting])


async def test_what_the_planner_of_a_killed_daemon_had_written_goes(
    planner: Make, task: GroundTask, tmp_path: Path
) -> None:
    (tmp_path / "planning/native").mkdir(parents=True)
    (tmp_path / "planning/native/output.sas").write_text("searched")
    await planner("native").plan(Request(task), 5.0)
    assert not any((tmp_path / "planning/native").iterdir())


async def test_planner_works_where_no_folder_can_be_made(
    planner: Make, task: GroundTask, tmp_path: Path
) -> None:
    (tmp_path / "planning").write_text("a file")
    assert isinstance((await Planners([planner("native")]).plan(task, 5.0)).answer, Plan)


async def test_planner_for_which_no_descriptor_is_left_leaves_the_search_to_another(
    planner: Make, task: GroundTask, tmp_path: Path
) -> None:
    others, late = planner("native"), planner("pyperplan")
    await others.plan(Request(task), 5.0)
    with descriptors_left(2):  # its socket and pipe take more
        await Planners([late]).warm()
        alone = await Planners([late]).plan(task, 5.0)
        found = await Planners([others, late]).plan(task, 5.0)
    assert isinstance(alone.answer, GaveUp)
    assert "PLANNER_START planner pyperplan: " in alone.answer.why
    assert isinstance(found.answer, Plan)
    assert found.planner == "native"
    assert not (tmp_path / "planning/pyperplan").exists()
    assert isinstance(await late.plan(Request(task), 5.0), Plan)


async def test_first_valid_plan_wins(planner: Make, task: GroundTask) -> None:
    planners = Planners([planner("hanger"), planner("liar"), planner("pyperplan")])
    found = await planners.plan(task, 20.0)
    assert isinstance(found.answer, Plan)
    assert found.planner == "pyperplan"


@pytest.fixture
def costly() -> GroundTask:
    """A small task whose shortest plan is dear: its first plan may come from a planner that knows
    no costs."""
    fact = frozenset[int]
    dear, cheap = fact({0}), fact({1})
    return GroundTask(
        ("start", "half", "done"),
        dear,
        fact({2}),
        (
            GroundAction("leap", dear, fact({2}), fact(), 9),
            GroundAction("step", dear, cheap, fact(), 1),
            GroundAction("step on", cheap, fact({2}), fact(), 1),
        ),
    )


async def test_cheaper_plan_is_waited_for(
    planner: Make, costly: GroundTask, clock: VirtualClock
) -> None:
    planners = Planners([planner("spender"), planner("native")])
    found = await arrived("both plans", planners.plan(costly, 20.0))
    assert found.answer == Plan((1, 2), 2)
    assert found.planner == "native"


async def test_cheaper_plan_is_not_waited_for_long(
    planner: Make, costly: GroundTask, clock: VirtualClock
) -> None:
    spender = planner("spender")
    await spender.plan(Request(costly), 20.0)
    planning = Planners([spender, planner("hanger")]).plan(costly, 20.0)
    found = await clock.advance_until(planning, step_s=CHEAPER_S / 10)
    assert (found.planner, found.answer) == ("spender", Plan((0,), 9))
    assert found.took_s < 20.0


def with_everything() -> GroundTask:
    """Needs a conditional effect and a derived fact."""
    lit = ConditionalEffect(frozenset({0}), frozenset({1}), frozenset())
    light = GroundAction("light", frozenset(), frozenset(), frozenset(), conditional=(lit,))
    layer = Layer((Rule(2, frozenset({1})),), ((2, 3),))
    facts = ("lamp", "lit", "bright", "!bright")
    return GroundTask(facts, frozenset({0}), frozenset({2}), (light,), (layer,))


async def test_planners_are_asked_what_they_handle(planner: Make) -> None:
    found = await Planners([planner("pyperplan")]).plan(with_everything(), 5.0)
    assert found.answer == GaveUp(
        "pyperplan: it does not handle conditional-effects and derived-predicates"
    )


async def test_native_planner_handles_everything(planner: Make) -> None:
    found = await Planners([planner("native")]).plan(with_everything(), 5.0)
    assert found.answer == Plan((0,), 1)


def written(plan: str) -> Callable[[], PddlTask]:
    """PDDL in which the reader finds what it answers."""
    return lambda: PddlTask("(define (domain d))", plan)


async def test_plan_of_a_text_planner_is_found_by_its_names(
    planner: Make, task: GroundTask
) -> None:
    names = ("pick ball0 a", "move a b", "drop ball0 b")
    found = await Planners([planner("reader")]).plan(task, 5.0, written(",".join(names)))
    assert found.answer == plan_of(task, *names)
    assert found.planner == "reader"


async def test_step_that_cannot_help_is_left_out(planner: Make, task: GroundTask) -> None:
    """The text may have actions that the ground task does without."""
    text = written("pick ball0 a,whistle,move a b,drop ball0 b")
    found = await Planners([planner("reader")]).plan(task, 5.0, text)
    assert found.answer == plan_of(task, "pick ball0 a", "move a b", "drop ball0 b")


@pytest.mark.parametrize(
    ("plan", "why"),
    [
        ("move a b,pick ball0 a", "step 2, pick ball0 a, cannot be taken"),
        ("move a b", "at the end (in ball0 b) does not hold"),
    ],
)
async def test_text_plan_is_checked(planner: Make, task: GroundTask, plan: str, why: str) -> None:
    found = await Planners([planner("reader")]).plan(task, 5.0, written(plan))
    assert found.answer == GaveUp(f"reader: its plan is not valid: {why}")


async def test_text_planner_is_not_believed_without_proof(planner: Make, task: GroundTask) -> None:
    found = await Planners([planner("sceptic")]).plan(task, 5.0, written(""))
    assert found.answer == GaveUp("sceptic: it claims a proof that does not hold")


async def test_text_is_made_only_where_it_is_wanted(planner: Make, task: GroundTask) -> None:
    made: list[str] = []

    def text() -> PddlTask:
        made.append("text")
        return PddlTask("", "")

    assert isinstance((await Planners([planner("native")]).plan(task, 5.0, text)).answer, Plan)
    assert not made


async def test_text_planner_gives_up_without_text(planner: Make, task: GroundTask) -> None:
    found = await Planners([planner("reader")]).plan(task, 5.0)
    assert found.answer == GaveUp("reader: the task is not told in pddl")


async def test_killed_planner_comes_back(planner: Make, task: GroundTask) -> None:
    process = planner("pyperplan")
    await process.plan(Request(task), 5.0)
    assert process.pid is not None
    os.kill(process.pid, signal.SIGSTOP)
    asked = asyncio.create_task(process.plan(Request(task), 5.0))
    await asyncio.sleep(0)  # it has the task, and cannot answer
    os.kill(process.pid, signal.SIGKILL)
    with pytest.raises(PlannerFailed):
        await asked
    assert isinstance(await process.plan(Request(task), 5.0), Plan)


async def test_cancelling_kills_the_search(planner: Make, task: GroundTask) -> None:
    process = planner("hanger")
    search = asyncio.create_task(process.plan(Request(task), 60.0))
    pid = await until_async("its process", lambda: process.pid or 0)
    search.cancel()
    with pytest.raises(asyncio.CancelledError):
        await search
    assert process.pid is None
    assert not is_alive(pid)


async def test_unreaped_child_is_reaped_at_last(planner: Make, task: GroundTask) -> None:
    process = planner("hanger")
    search = asyncio.create_task(process.plan(Request(task), 60.0))
    pid = await until_async("its process", lambda: process.pid or 0)
    search.cancel()
    await asyncio.sleep(0)
    search.cancel()  # while it waits for the child that the first one killed
    with pytest.raises(asyncio.CancelledError):
        await search
    await process.close()
    assert not is_alive(pid)


async def test_follow_plan_is_the_only_one(planner: Make) -> None:
    task = follow_task()
    found = await Planners([planner("pyperplan")]).plan(task, 5.0)
    assert isinstance(found.answer, Plan)
    names = [task.actions[step].name for step in found.answer.steps]
    assert [name.split(" ")[0] for name in names] == [n.split(" ")[0] for n in FOLLOW_PLAN]
