"""Workers that are services: the host sees and judges what the service uses, though the process
that it started only stands in for it. A cgroup of this machine is in the place of systemd's."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.workers.excesses import (
    DO,
    FORK,
    PLUGIN,
    WATCHED,
    exited_by_forking,
    strained_by_spinning,
)
from tests.kit.clock import VirtualClock
from tests.kit.workers import HOST, WorkersUnderTest

from nondum.host.cgroups import CageLimits
from nondum.host.cgroups.cages import Cage, owner, tree
from nondum.host.cgroups.mounts import here
from nondum.host.cgroups.services import ServiceGroup
from nondum.host.confinement.bubblewrap import Ground
from nondum.host.events import WorkerExited, WorkerStrained
from nondum.host.workers import Limits, WorkerLauncher, WorkerSpec
from nondum.host.workers.confinements import Entry, Unconfined
from nondum.sdk.description import Unit

pytestmark = pytest.mark.anyio

SMALL = Limits(tasks=24, descriptors=64)
UNIT = "served.1"


class Elsewhere(Unconfined):
    """Puts each worker where only a service's cgroup tells of it."""

    def __init__(self, state: Path) -> None:
        self._tree = tree(here(), owner(state))

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """As systemd does, once it is asked."""
        with super().entry(spec, ground) as entry:
            yield replace(entry, service=self._served)

    def _served(self, pid: int) -> ServiceGroup:
        self._tree.make(UNIT)
        cage = Cage(self._tree, UNIT)
        cage.limit(CageLimits(tasks=SMALL.tasks))
        cage.add(pid)
        return ServiceGroup(UNIT, self._tree)

    def end(self) -> None:
        """End what is left."""
        assert Cage(self._tree, UNIT).end()
        self._tree.close()


@pytest.fixture
async def served(tmp_path: Path, clock: VirtualClock) -> AsyncIterator[WorkersUnderTest]:
    """Workers that are all services."""
    timing = replace(WATCHED, backoff_s=1e9)  # one life is enough
    tested, elsewhere = WorkersUnderTest(tmp_path, timing), Elsewhere(tmp_path)
    tested.workers.launcher = WorkerLauncher(elsewhere)
    yield tested
    await clock.advance_until(tested.workers.close())
    elsewhere.end()


async def begin(tested: WorkersUnderTest, body: str) -> None:
    source = PLUGIN.replace("{body}", body.replace("\n", "\n    "))
    unit = Unit("it", "sensor")
    await tested.start("guest", source, behaviours=(DO,), units=(unit,), limits=SMALL)
    tested.behave("guest", "do", u=f"{HOST}__guest__it")


async def test_service_that_forks_without_end_is_ended(
    served: WorkersUnderTest, clock: VirtualClock
) -> None:
    await begin(served, FORK)
    exited = await exited_by_forking(served, clock)
    assert exited.reason.startswith("WORKER_TASKS"), exited.reason


async def test_service_that_ends_by_its_limit_of_tasks_says_so(
    served: WorkersUnderTest, clock: VirtualClock
) -> None:
    """Its cgroup goes with it; what was seen last counts."""
    body = (
        "while not os.path.exists('seen'):\n"
        "    try:\n"
        "        threading.Thread(target=time.sleep, args=(60,), daemon=True).start()\n"
        "    except RuntimeError as refused:\n"
        "        error = refused\n"
        "        await asyncio.sleep(0.01)\n"
        "print(f'RuntimeError: {error}', file=sys.stderr, flush=True)\n"
        "os._exit(1)"
    )
    await begin(served, body)
    strained = await clock.advance_until(served.until(WorkerStrained))
    assert [problem.code for problem in strained.problems] == ["WORKER_TASKS"]
    (served.folder / "guest/scratch/seen").touch()
    exited = await served.until(WorkerExited)
    assert exited.reason.startswith("WORKER_TASKS"), exited.reason


async def test_descriptors_of_a_service_are_counted(
    served: WorkersUnderTest, clock: VirtualClock
) -> None:
    body = "held = []\nwhile True:\n    try:\n        held.append(os.dup(1))\n"
    await begin(served, f"{body}    except OSError:\n        await asyncio.sleep(0.01)")
    exited = await clock.advance_until(served.until(WorkerExited))
    assert exited.reason.startswith("WORKER_FDS"), exited.reason


async def test_service_that_spins_is_told_of(served: WorkersUnderTest, clock: VirtualClock) -> None:
    spin = "def spin():\n    while True:\n        pass\n"
    await begin(served, f"{spin}threading.Thread(target=spin, daemon=True).start()")
    strained = await strained_by_spinning(served, clock)
    assert [problem.code for problem in strained.problems] == ["WORKER_CPU"]


async def test_service_that_ends_by_its_full_scratch_folder_says_so(
    served: WorkersUnderTest,
) -> None:
    """Which is memory of a size of its own, into which the host cannot look."""
    body = "print(OSError(28, os.strerror(28)), file=sys.stderr, flush=True)\nos._exit(1)"
    await begin(served, body)
    exited = await served.until(WorkerExited)
    assert exited.reason.startswith("SCRATCH_FULL"), exited.reason
