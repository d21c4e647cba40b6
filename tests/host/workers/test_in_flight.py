"""A worker that sends descriptors which nothing reads: the kernel then refuses all processes of the
user to send any. Others wait, the one is found and ended."""

from __future__ import annotations

import os
import socket
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.workers.flooding import fills_and_streams
from tests.host.workers.streaming import sees
from tests.kit.workers import LIBRARIES, SDK, TIMING, WorkersUnderTest, confinement_state, level

from nondum.host.core.events.workers import WorkerExited, WorkerReady
from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.workers import confinement_choice
from nondum.host.workers.in_flight import culprit, sent
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spec import WorkerSpec
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.wheelhouse.format.confinement import Level

pytestmark = pytest.mark.anyio


@pytest.fixture
async def tested(tmp_path: Path) -> AsyncIterator[WorkersUnderTest]:
    """Workers that share a user, also where each could have its own."""
    shared = confinement_choice.confinement(
        replace(confinement_state(), findings=()), (tmp_path, SDK, LIBRARIES)
    )
    tested = WorkersUnderTest(tmp_path, confinement=shared)
    cgroups = Cgroups.open(tmp_path)
    tested.workers.launcher = WorkerLauncher(tested.confinement, cgroups)
    yield tested
    await tested.workers.close(grace_s=1.0)
    cgroups.close()


def ways() -> list[str]:
    """What waits in sockets that are under way is seen in a sandbox, and in a cgroup."""
    hidden = level() is Level.SANDBOXED and bool(Cgroups.open(Path("/nowhere")).holds)
    return ["openly", "by_a_child", *(["in_sockets_that_are_under_way"] if hidden else [])]


@pytest.mark.parametrize("way", ways())
async def test_streams_of_other_workers_wait_until_the_worker_is_found_and_ended(
    tested: WorkersUnderTest, way: str
) -> None:
    await fills_and_streams(tested, way)
    exited = await tested.until(WorkerExited)
    assert exited.component == "hostile"
    assert exited.reason.startswith("WORKER_IN_FLIGHT")
    await sees(tested, "watcher")
    assert tested.workers.search.refusals > 0
    assert {event.component for event in tested.told(WorkerExited)} == {"hostile"}
    assert len([e for e in tested.told(WorkerReady) if e.component == "cam"]) == 1


@pytest.mark.skipif(not confinement_state().has_users, reason="workers share a user here")
@pytest.mark.parametrize("way", ways())
async def test_no_worker_waits_where_each_one_is_a_separate_user(tmp_path: Path, way: str) -> None:
    tested = WorkersUnderTest(tmp_path)
    await fills_and_streams(tested, way)
    await sees(tested, "watcher")
    assert tested.workers.search.refusals == 0
    assert not tested.told(WorkerExited)
    await tested.workers.close(grace_s=1.0)


def test_what_waits_with_a_reader_counts_for_its_sender() -> None:
    one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with one, other:
        for _ in range(10):
            socket.send_fds(one, [b"x"], [0] * 10)
        inode = os.fstat(other.fileno()).st_ino
        found = sent({os.getpid()}, "reader", {inode: "sender"}, is_whole=False)
    assert found["sender"] == 100
    assert culprit(found, {}) == "sender"


@pytest.mark.parametrize(
    ("counts", "ends", "ended"),
    [
        pytest.param({}, {}, None, id="no worker"),
        pytest.param({"a": 64}, {}, None, id="few"),
        pytest.param({"a": 65}, {}, "a", id="many"),
        pytest.param({"a": 94}, {"a": 10}, None, id="its streams explain them"),
        pytest.param({"a": 900, "b": 300}, {"a": 250}, "b", id="more than its streams explain"),
        pytest.param({"b": 70, "a": 70}, {}, "a", id="as many"),
    ],
)
def test_most_beyond_its_streams_is_the_culprit(
    counts: dict[str, int], ends: dict[str, int], ended: str | None
) -> None:
    assert culprit(counts, ends) == ended


class Crowded:
    """Can hand nothing to the first workers, as a daemon without privileges for a while."""

    def __init__(self, launcher: WorkerLauncher, refusals: int) -> None:
        self.level = launcher.level
        self.warm, self.close = launcher.warm, launcher.close
        self._launcher, self.refusals = launcher, refusals

    async def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        if self.refusals:
            self.refusals -= 1
            raise WorkerFailed(Problem("LAUNCH_CROWDED", "as if", where=spec.component))
        return await self._launcher.launch(spec, sock)


async def test_worker_that_cannot_be_started_yet_is_tried_again(tmp_path: Path) -> None:
    tested = WorkersUnderTest(tmp_path, replace(TIMING, startup_s=60.0))
    launcher = tested.workers.launcher
    assert isinstance(launcher, WorkerLauncher)
    tested.workers.launcher = Crowded(launcher, refusals=2)
    await tested.start("good", "")
    assert tested.workers.search.refusals == 2
    await tested.workers.close()
