"""Workers that use too much: each ends itself only, with its code, and the others go on."""

from __future__ import annotations

import errno
import os
from collections.abc import AsyncIterator
from pathlib import Path

import anyio
import pytest
from tests.host.workers.excesses import FORK, WATCHED, exited_by_forking, strained_by_spinning
from tests.kit.clock import VirtualClock
from tests.kit.guest import do, guest_spec
from tests.kit.processes import is_alive
from tests.kit.workers import WorkersUnderTest

from nondum.host.core.events.workers import WorkerExited, WorkerLogged
from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spec import Limits
from nondum.planning.execute.running import RunState

pytestmark = pytest.mark.anyio

SMALL = Limits(memory_mb=128, tasks=24, descriptors=64, scratch_mb=8)


@pytest.fixture
async def in_cgroup(tmp_path: Path, clock: VirtualClock) -> AsyncIterator[WorkersUnderTest]:
    """Workers in control groups; another one is there before and after."""
    cgroups = Cgroups.open(tmp_path)
    assert cgroups.holds == {"memory", "pids", "cpu"}, "tests run as root, with cgroups"
    tested = WorkersUnderTest(tmp_path, WATCHED)
    tested.workers.launcher = WorkerLauncher(cgroups=cgroups)
    await begin(tested, "other", "pass")
    pid = tested.workers.pids()["other"]
    yield tested
    assert await done(tested, "other") is RunState.SUCCEEDED
    assert tested.workers.pids()["other"] == pid
    assert is_alive(pid)
    await tested.close(clock)
    assert cgroups.sweep() == 0, "cgroups are left"
    cgroups.close()


async def begin(tested: WorkersUnderTest, name: str, body: str) -> None:
    await tested.workers.start(guest_spec(tested, body, name=name, limits=SMALL))


async def done(tested: WorkersUnderTest, name: str) -> RunState:
    return await do(tested, name).ended()


HELD = (
    "held = [open(f'f{n}', 'wb') for n in range(4)]\n"
    "for file in held:\n    os.unlink(file.name)\n"
    "while True:\n"
    "    for file in held:\n        file.write(bytes(1 << 20)); file.flush()\n"
    "    await asyncio.sleep(0.01)"
)
DEEP = "for _ in range(300):\n    os.mkdir('d' * 50); os.chdir('d' * 50)\nawait asyncio.sleep(60)"
CHILD = "b = []\nwhile True: b.append(bytearray(1 << 20))"


@pytest.mark.parametrize(
    ("body", "code"),
    [
        pytest.param(
            "import mmap\nheld = []\nwhile True:\n"
            "    held.append(mmap.mmap(-1, 1 << 20)); held[-1].write(bytes(1 << 20))",
            "WORKER_OOM",
            id="shared memory",
        ),
        pytest.param(
            f"await asyncio.to_thread(subprocess.run, [sys.executable, '-c', {CHILD!r}])\n"
            "await asyncio.to_thread(subprocess.run, [sys.executable, '-c', "
            "'import mmap; [m.write(bytes(1<<20)) for m in iter(lambda: mmap.mmap(-1,1<<20), 0) "
            'for _ in [globals().setdefault("b", []).append(m)]]\'])\n'
            "await asyncio.sleep(60)",
            "WORKER_OOM",
            id="memory of a child",
        ),
        pytest.param(FORK, "WORKER_TASKS", id="fork bomb"),
        pytest.param(
            "held = []\nwhile True:\n    try:\n        held.append(os.dup(1))\n"
            "    except OSError:\n        await asyncio.sleep(0.01)",
            "WORKER_FDS",
            id="descriptors",
        ),
        pytest.param(
            "with open('big', 'wb') as file:\n    while True:\n        file.write(bytes(1 << 20))\n"
            "        await asyncio.sleep(0.01)",
            "SCRATCH_FULL",
            id="file",
        ),
        pytest.param(HELD, "SCRATCH_FULL", id="deleted files"),
        pytest.param(DEEP, "SCRATCH_FULL", id="deep folders"),
    ],
)
async def test_too_much_ends_that_worker_alone(
    in_cgroup: WorkersUnderTest, clock: VirtualClock, body: str, code: str
) -> None:
    await begin(in_cgroup, "guest", body)
    call = do(in_cgroup)
    if body == FORK:
        exited = await exited_by_forking(in_cgroup, clock)
    else:
        exited = await clock.advance_until(in_cgroup.until(WorkerExited))
    assert exited.component == "guest"
    assert exited.reason.startswith(code), exited.reason
    assert "→" in exited.reason, "it is told what to do"
    assert await call.ended() is RunState.FAILED
    await in_cgroup.until_ready(3)
    if code == "SCRATCH_FULL":
        assert os.listdir(in_cgroup.folder / "guest/scratch") == []  # noqa: PTH208


MEMFD = (
    "held = os.memfd_create('held')\n"
    "for _ in range(400):\n    os.write(held, bytes(1 << 20))\n    await asyncio.sleep(0)\n"
    "await asyncio.sleep(60)"
)
SHARED = (
    "import mmap\nheld = []\nfor _ in range(400):\n    held.append(mmap.mmap(-1, 1 << 20))\n"
    "    held[-1].write(bytes(1 << 20))\n    await asyncio.sleep(0)\nawait asyncio.sleep(60)"
)
HALF = "b = bytearray(70 << 20); import time; time.sleep(60)"
CHILDREN = (
    f"for _ in range(2): subprocess.Popen([sys.executable, '-c', {HALF!r}])\n"
    "await asyncio.sleep(60)"
)


@pytest.mark.parametrize(
    "body",
    [
        pytest.param(MEMFD, id="file in memory"),
        pytest.param(SHARED, id="shared memory"),
        pytest.param(CHILDREN, id="children that are within the limit each"),
    ],
)
async def test_without_control_groups_memory_is_looked_at(
    tmp_path: Path, clock: VirtualClock, body: str
) -> None:
    tested = WorkersUnderTest(tmp_path, WATCHED)
    await begin(tested, "other", "pass")
    await begin(tested, "guest", body)
    call = do(tested)
    exited = await clock.advance_until(tested.until(WorkerExited))
    assert (exited.component, exited.reason.partition(" ")[0]) == ("guest", "WORKER_OOM")
    assert await call.ended() is RunState.FAILED
    assert await done(tested, "other") is RunState.SUCCEEDED
    await tested.close(clock)


async def test_what_cannot_be_deleted_is_told_and_holds_nothing_up(
    in_cgroup: WorkersUnderTest, clock: VirtualClock
) -> None:
    held = in_cgroup.folder / "guest/scratch/held"
    body = (
        "os.mkdir('held'); subprocess.run(['mount', '-t', 'tmpfs', 'tmpfs', 'held'], check=True)\n"
        "with open('zeros', 'wb') as file:\n    file.write(bytes(9 << 20))\n"
        "await asyncio.sleep(60)"
    )
    await begin(in_cgroup, "guest", body)
    do(in_cgroup)
    try:
        exited = await clock.advance_until(in_cgroup.until(WorkerExited))
        assert exited.reason.startswith("SCRATCH_FULL"), exited.reason
        told = [line.message for line in in_cgroup.told(WorkerLogged) if line.level == "error"]
        assert any(os.strerror(errno.EBUSY) in line for line in told), told
        await in_cgroup.until_ready(3)
        assert [each.name for each in held.parent.iterdir()] == ["held"], "all else is deleted"
    finally:
        await anyio.run_process(["umount", str(held)])


async def test_worker_that_ends_by_its_limit_of_tasks_says_so(in_cgroup: WorkersUnderTest) -> None:
    body = (
        "threading.stack_size(1 << 18)  # memory is not to end first\n"
        "try:\n"
        "    for _ in range(1000):\n"
        "        threading.Thread(target=time.sleep, args=(60,), daemon=True).start()\n"
        "except RuntimeError as refused:\n"
        "    print(f'RuntimeError: {refused}', file=sys.stderr, flush=True)\n"
        "    os._exit(1)"
    )
    await begin(in_cgroup, "guest", body)
    do(in_cgroup)
    exited = await in_cgroup.until(WorkerExited)
    assert exited.reason.startswith("WORKER_TASKS"), exited.reason
    await in_cgroup.until_ready(3)


async def test_idle_worker_that_spins_is_told_once(
    in_cgroup: WorkersUnderTest, clock: VirtualClock
) -> None:
    spin = "def spin():\n    while True:\n        pass\n"
    await begin(in_cgroup, "guest", f"{spin}threading.Thread(target=spin, daemon=True).start()")
    assert await done(in_cgroup, "guest") is RunState.SUCCEEDED
    strained = await strained_by_spinning(in_cgroup, clock)
    assert strained.component == "guest"
    assert [problem.code for problem in strained.problems] == ["WORKER_CPU"]
    assert not in_cgroup.told(WorkerExited)


async def test_what_left_the_group_and_cleared_its_marks_ends_with_the_cgroup(
    in_cgroup: WorkersUnderTest,
) -> None:
    child = "import os,time; print('child', os.getpid(), flush=True); time.sleep(3600)"
    body = (
        "if os.fork() == 0:\n"
        "    os.setsid()\n"
        "    if os.fork() == 0:\n"
        f"        os.execve(sys.executable, [sys.executable, '-c', {child!r}], {{}})\n"
        "    os._exit(0)\n"
        "await asyncio.Event().wait()"
    )
    await begin(in_cgroup, "guest", body)
    do(in_cgroup)
    said = await in_cgroup.until(WorkerLogged, lambda line: line.message.startswith("child"))
    pid = int(said.message.split()[1])
    assert is_alive(pid)
    await in_cgroup.workers.stop("guest")
    assert not is_alive(pid)
