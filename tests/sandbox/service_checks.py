"""What a daemon that is the service's user finds of its workers, each of which is another user.

Each function of `CHECKS` is one check; `tests.sandbox.service` runs this where they can be.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import socket
import sys
import traceback
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

from tests.host.workers.flooding import fills_and_streams
from tests.host.workers.streaming import sees
from tests.kit.guest import do, guest_spec
from tests.kit.workers import LIBRARIES, SDK, TIMING, WorkersUnderTest
from tests.sandbox.guests import status
from tests.sandbox.service import GROUP, LINE, LINE_OF_GROUP, STATE, USER

from nondum.host.core.events.workers import WorkerExited, WorkerLogged
from nondum.host.manager.state_folders import remove
from nondum.host.sandbox.helper import HelperClient
from nondum.host.sandbox.helper.worker_users import OF_SERVICE
from nondum.host.sandbox.levels.users import Users
from nondum.host.workers import confinement_choice, confinement_probe, scratch
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.spec import Limits, WorkerSpec
from nondum.planning.execute.running import RunState
from nondum.wheelhouse.format.confinement import Level

Check = Callable[[WorkersUnderTest], Awaitable[None]]
NOTHING = "print('here', flush=True)"
LEAVES = """
import os
os.mkdir('inner')
open('inner/file', 'w').write('x' * 5000)
os.chmod('inner/file', 0)
print('here', flush=True)
"""
LISTS = """
import os, stat
found = 0
for name in range(64):
    try:
        found += stat.S_ISDIR(os.fstat(name).st_mode)
    except OSError:
        pass
print('folders', found, flush=True)
print('here', flush=True)
"""
HOLDS = """
import os
held = open('held', 'wb')
os.unlink('held')
held.write(bytes(3 << 20))
held.flush()
many = [os.dup(1) for _ in range(100)]
print('here', flush=True)
"""
OPENS = "os.close(os.open(ctx.device('line').node, os.O_RDWR | os.O_NOCTTY))"


async def started(tested: WorkersUnderTest, component: str, source: str = NOTHING) -> Path:
    """Its scratch folder, once a worker has done its thing."""
    spec = await tested.start(component, source)
    await tested.until(WorkerLogged, lambda e: (e.component, e.message) == (component, "here"))
    return spec.scratch


async def each_worker_is_a_user_and_its_files_are_the_daemons(tested: WorkersUnderTest) -> None:
    places = [await started(tested, name, LEAVES) for name in ("one", "other")]
    users = [status(tested.workers.pids()[name])["Uid"].split() for name in ("one", "other")]
    (first,), (second,) = map(set, users)
    assert int(first) in OF_SERVICE and int(second) in OF_SERVICE and first != second
    for place in places:
        assert {place.stat().st_uid, (place / "inner").stat().st_uid} == {USER.pw_uid}
    await tested.workers.stop("one")
    (places[0] / "inner").chmod(0)
    remove(places[0])
    assert not places[0].exists()


async def worker_is_in_the_daemons_groups_and_no_other(tested: WorkersUnderTest) -> None:
    await started(tested, "one")
    told = status(tested.workers.pids()["one"])
    assert told["Groups"].split() == [str(GROUP)]
    assert all(int(group) in OF_SERVICE for group in told["Gid"].split())


async def worker_inherits_no_folder(tested: WorkersUnderTest) -> None:
    await started(tested, "one", LISTS)
    await tested.until(WorkerLogged, lambda e: e.message == "folders 0")


async def what_it_holds_open_is_counted(tested: WorkersUnderTest) -> None:
    place = await started(tested, "one", HOLDS)
    process = process_of(tested, "one")
    seen = await process.open_files()
    assert seen is not None
    assert seen.deleted_bytes >= 3 << 20 and scratch.used_bytes(place) < 1 << 20
    assert 100 < seen.descriptors < 200


async def deleted_files_that_it_holds_fill_its_scratch(tested: WorkersUnderTest) -> None:
    await tested.start("one", HOLDS, limits=Limits(scratch_mb=1))
    exited = await tested.until(WorkerExited)
    assert exited.reason.startswith("SCRATCH_FULL"), exited.reason


async def init_that_is_kept_from_answering_counts_as_too_much(tested: WorkersUnderTest) -> None:
    await started(tested, "one")
    os.kill(init_of(tested.workers.pids()["one"]), signal.SIGSTOP)
    exited = await tested.until(WorkerExited)
    assert exited.reason.startswith("SCRATCH_FULL"), exited.reason


async def device_is_the_workers_and_no_other_ones(tested: WorkersUnderTest) -> None:
    for name in ("one", "other"):
        await tested.workers.start(guest_spec(tested, OPENS, name=name))
    await tested.workers.attach("one", "line", str(LINE), {})
    call = do(tested, "one")
    assert await call.ended() is RunState.SUCCEEDED, call.reason
    node = Path("/run/nondum-helper/devices/one/line")
    (user,) = set(status(tested.workers.pids()["one"])["Uid"].split())
    assert owner_of(node) == int(user)
    await tested.workers.detach("one", "line")
    assert owner_of(node) is None


async def device_that_a_worker_may_open_anyway_needs_no_node(
    tested: WorkersUnderTest,
) -> None:
    for node in (LINE_OF_GROUP, Path("/dev/full")):
        assert HelperClient().put_node("one", "line", node, OF_SERVICE.start) == node


async def flood_of_descriptors_holds_no_other_worker_up(tested: WorkersUnderTest) -> None:
    await fills_and_streams(tested, "openly")
    await sees(tested, "watcher")
    assert tested.workers.search.refusals == 0
    assert not tested.told(WorkerExited)


async def worker_that_ends_is_started_again(tested: WorkersUnderTest) -> None:
    await started(tested, "one")
    os.kill(tested.workers.pids()["one"], signal.SIGKILL)
    await tested.until_ready(2)
    (user,) = set(status(tested.workers.pids()["one"])["Uid"].split())
    assert int(user) in OF_SERVICE


async def sandboxes_are_found_to_have_users(tested: WorkersUnderTest) -> None:
    file = STATE / "confinement.json"
    place = STATE / "probes"
    (found,) = confinement_probe.findings(file, place)
    assert (found.has_users, found.reason) == (True, ""), found.reason
    assert confinement_probe.findings(file, place) == (found,)
    assert not list(place.iterdir())


async def where_files_cannot_be_mapped_workers_share_a_user_and_it_is_told(
    tested: WorkersUnderTest,
) -> None:
    """procfs is no place for files at all, let alone mapped ones."""
    found = confinement_probe.all_findings(Path("/proc"))[0]
    assert found.is_available and not found.has_users
    assert "not possible" in found.reason


async def no_two_scratch_folders_have_one_user(tested: WorkersUnderTest) -> None:
    places = [tested.folder / f"payload-{n}" / "same" for n in range(40)]
    for place in places:
        place.mkdir(parents=True)
    users = Users(OF_SERVICE)
    given = [users.of(place) for place in places]
    assert len(set(given)) == len(places)
    assert all(user in OF_SERVICE for user in given)


CHECKS: tuple[Check, ...] = (
    each_worker_is_a_user_and_its_files_are_the_daemons,
    worker_is_in_the_daemons_groups_and_no_other,
    worker_inherits_no_folder,
    what_it_holds_open_is_counted,
    deleted_files_that_it_holds_fill_its_scratch,
    init_that_is_kept_from_answering_counts_as_too_much,
    device_is_the_workers_and_no_other_ones,
    device_that_a_worker_may_open_anyway_needs_no_node,
    flood_of_descriptors_holds_no_other_worker_up,
    worker_that_ends_is_started_again,
    sandboxes_are_found_to_have_users,
    where_files_cannot_be_mapped_workers_share_a_user_and_it_is_told,
    no_two_scratch_folders_have_one_user,
)


class Kept(WorkerLauncher):
    """Keeps the processes that it has started."""

    def __init__(self, confinement: Confinement) -> None:
        super().__init__(confinement)
        self.processes: dict[str, WorkerProcess] = {}

    async def launch(self, spec: WorkerSpec, sock: socket.socket) -> WorkerProcess:
        self.processes[spec.component] = await super().launch(spec, sock)
        return self.processes[spec.component]


def process_of(tested: WorkersUnderTest, component: str) -> WorkerProcess:
    """That of its worker."""
    assert isinstance(tested.workers.launcher, Kept)
    return tested.workers.launcher.processes[component]


def owner_of(node: Path) -> int | None:
    """Whose a node is; None: it is gone."""
    return node.stat().st_uid if node.exists() else None


def init_of(pid: int) -> int:
    """The parent process of a worker: init, process 1 of its sandbox."""
    return int(status(pid)["PPid"])


async def found_by(check: Check) -> str:
    """Why a check failed; empty if it did not."""
    folder = STATE / check.__name__
    folder.mkdir()
    confinement_state = confinement_choice.confinement_state(
        "auto", Level.NONE, STATE / "confinement-state.json", STATE / "probes"
    )
    confinement = confinement_choice.confinement(confinement_state, (folder, SDK, LIBRARIES))
    tested = WorkersUnderTest(folder, replace(TIMING, look_s=0.2), confinement)
    tested.workers.launcher = Kept(confinement)
    try:
        await check(tested)
    except Exception:
        return traceback.format_exc()
    finally:
        await tested.workers.close(grace_s=1.0)
    return ""


def main() -> None:
    """Run all checks."""
    found = {check.__name__: asyncio.run(found_by(check)) for check in CHECKS}
    sys.stdout.write(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
