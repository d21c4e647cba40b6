"""Process 1 of a room, and the worker that it starts: what each of them holds."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tests.confinement.guests import does, guest, parent, status
from tests.kit.workers import WorkersUnderTest

from nondum.host.inside import kernel
from nondum.host.workers.confinements import Boxed, Confinement, Held, Unconfined

pytestmark = pytest.mark.anyio
BWRAP = shutil.which("bwrap") or "bwrap"


async def test_keeper_has_its_system_calls_filtered(tested: WorkersUnderTest) -> None:
    await guest(tested, "pass")
    keeper = parent(tested.workers.pids()["guest"])
    assert status(keeper)["Seccomp"] == "2"


async def test_keeper_can_do_nothing_but_mount(tested: WorkersUnderTest) -> None:
    await guest(tested, "pass")
    keeper = status(parent(tested.workers.pids()["guest"]))
    assert keeper["Name"] == "keeper"
    for each in ("CapPrm", "CapEff", "CapBnd"):
        assert int(keeper[each], 16) == 1 << kernel.CAP_SYS_ADMIN


async def test_keeper_holds_neither_the_link_nor_the_output_of_its_worker(
    tested: WorkersUnderTest,
) -> None:
    await guest(tested, "pass")
    keeper = parent(tested.workers.pids()["guest"])
    open_there = list(held_by(keeper).values())
    assert sorted(set(map(kind_of, open_there))) == ["/dev/null", "pipe", "socket"]
    assert sum(kind_of(each) == "socket" for each in open_there) == 1
    assert len({each for each in open_there if kind_of(each) == "pipe"}) == 1, "its own alarm"


HOLDS_NOTHING = """
assert os.getsid(0) == os.getpid()
held = subprocess.run(['ls', '/proc/self/fd'], close_fds=False, capture_output=True, text=True)
assert held.stdout.split() == ['0', '1', '2', '3'], held  # the last one is the folder itself
"""


@pytest.mark.parametrize("confinement", [Boxed(BWRAP), Held(), Unconfined()], ids=type)
async def test_worker_has_a_session_of_its_own_and_holds_its_link_only(
    tmp_path: Path, confinement: Confinement
) -> None:
    tested = WorkersUnderTest(tmp_path, confinement=confinement)
    await guest(tested, HOLDS_NOTHING)
    assert await does(tested) == ""
    worker = tested.workers.pids()["guest"]
    assert status(worker)["Name"] == "guest"
    others = [each for number, each in held_by(worker).items() if number > 2]
    # The link, and what asyncio has made: an epoll instance, and a pair of sockets.
    assert sorted(map(kind_of, others)) == ["anon_inode", "socket", "socket", "socket"]
    await tested.workers.close()


def kind_of(link: str) -> str:
    return link.partition(":")[0]


def held_by(pid: int) -> dict[int, str]:
    """The descriptors of a process."""
    return {int(path.name): str(path.readlink()) for path in Path(f"/proc/{pid}/fd").iterdir()}
