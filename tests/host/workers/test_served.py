"""Workers that are services: the host sees and judges what the service uses, though the process
that it started only stands in for it. A cgroup of this machine is in the place of systemd's."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.workers.test_excesses import DO, FORK, PLUGIN
from tests.kit.workers import HOST, QUICK, WorkersUnderTest

from nondum.host.cgroups import CageLimits
from nondum.host.cgroups.cages import Cage, owner, tree
from nondum.host.cgroups.mounts import here
from nondum.host.cgroups.services import ServiceGroup
from nondum.host.confinement.bubblewrap import Ground
from nondum.host.events import WorkerExited, WorkerStrained
from nondum.host.workers import Limits, WorkerLauncher, WorkerSpec, excess, supervision
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
async def served(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[WorkersUnderTest]:
    """Workers that are all services."""
    monkeypatch.setattr(supervision, "BACKOFF_S", 60.0)  # one life is enough
    tested, elsewhere = WorkersUnderTest(tmp_path, replace(QUICK, look_s=0.1)), Elsewhere(tmp_path)
    tested.workers.launcher = WorkerLauncher(elsewhere)
    yield tested
    await tested.workers.close(grace_s=1.0)
    elsewhere.end()


async def begin(tested: WorkersUnderTest, body: str) -> None:
    source = PLUGIN.replace("{body}", body.replace("\n", "\n    "))
    unit = Unit("it", "sensor")
    await tested.start("guest", source, behaviours=(DO,), units=(unit,), limits=SMALL)
    tested.behave("guest", "do", u=f"{HOST}__guest__it")


async def test_service_that_forks_without_end_is_ended(served: WorkersUnderTest) -> None:
    await begin(served, FORK)
    exited = await served.until(WorkerExited)
    assert exited.reason.startswith("WORKER_TASKS"), exited.reason


async def test_service_that_ends_by_its_limit_of_tasks_says_so(served: WorkersUnderTest) -> None:
    """Its cgroup goes with it; what was seen last counts."""
    body = "import threading\nawait asyncio.sleep(0.5)\nheld = []\n"
    body += "try:\n    while True:\n"
    body += "        held.append(threading.Thread(target=time.sleep, args=(60,), daemon=True))\n"
    body += "        held[-1].start()\n"
    body += "except RuntimeError as error:\n"
    body += "    await asyncio.sleep(1.0)\n"
    body += "    print(f'RuntimeError: {error}', file=sys.stderr, flush=True)\n    os._exit(1)"
    await begin(served, body)
    exited = await served.until(WorkerExited)
    assert exited.reason.startswith("WORKER_TASKS"), exited.reason


async def test_descriptors_of_a_service_are_counted(served: WorkersUnderTest) -> None:
    body = "held = []\nwhile True:\n    try:\n        held.append(os.dup(1))\n"
    await begin(served, f"{body}    except OSError:\n        await asyncio.sleep(0.01)")
    exited = await served.until(WorkerExited)
    assert exited.reason.startswith("WORKER_FDS"), exited.reason


async def test_service_that_spins_is_told_of(
    served: WorkersUnderTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(excess, "SPIN_S", 0.5)
    spin = "def spin():\n    while True:\n        pass\n"
    await begin(served, f"{spin}threading.Thread(target=spin, daemon=True).start()")
    strained = await served.until(WorkerStrained)
    assert [problem.code for problem in strained.problems] == ["WORKER_CPU"]


async def test_service_that_ends_by_its_full_scratch_folder_says_so(
    served: WorkersUnderTest,
) -> None:
    """Which is memory of a size of its own, into which the host cannot look."""
    body = "print(OSError(28, os.strerror(28)), file=sys.stderr, flush=True)\nos._exit(1)"
    await begin(served, body)
    exited = await served.until(WorkerExited)
    assert exited.reason.startswith("SCRATCH_FULL"), exited.reason
