"""Process 1 of a sandbox, and the worker that it starts: what each of them holds."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import socket
from pathlib import Path

import pytest
from tests.kit.workers import WorkersUnderTest
from tests.sandbox.guests import does, guest, parent, status

from nondum.host.sandbox.inside import kernel
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held
from nondum.host.workers.init_link import InitLink
from nondum.host.workers.launcher import parameters
from nondum.host.workers.spare import PLACEHOLDER, PLACEHOLDER_BYTES
from nondum.host.workers.unconfined import Unconfined

pytestmark = pytest.mark.anyio
BWRAP = shutil.which("bwrap") or "bwrap"


async def test_init_has_its_system_calls_filtered(tested: WorkersUnderTest) -> None:
    await guest(tested, "pass")
    init = parent(tested.workers.pids()["guest"])
    assert status(init)["Seccomp"] == "2"


async def test_init_can_do_nothing_but_mount(tested: WorkersUnderTest) -> None:
    await guest(tested, "pass")
    init = status(parent(tested.workers.pids()["guest"]))
    assert init["Name"] == "nondum-init"
    for each in ("CapPrm", "CapEff", "CapBnd"):
        assert int(init[each], 16) == 1 << kernel.CAP_SYS_ADMIN


async def test_init_says_who_it_is_so_that_the_end_of_its_sandbox_is_seen(
    tested: WorkersUnderTest,
) -> None:
    spec = tested.spec("guest", "")
    spec.scratch.mkdir(parents=True)
    confinement = Boxed(BWRAP)
    ground = confinement.ground(spec)
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
    link, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs, link, far, confinement.entry(spec, ground) as entry:
        process = await asyncio.create_subprocess_exec(
            *confinement.command(ground, theirs.fileno()),
            pass_fds=[theirs.fileno()],
            env={PLACEHOLDER: "-" * PLACEHOLDER_BYTES},
        )
        order = json.dumps(parameters(spec, entry, looks=True)).encode()
        socket.send_fds(ours, [order], [far.fileno()])
        init = InitLink(ours)
        assert await process.wait() == 0
    pidfd = init.take_pidfd()
    assert init.worker is not None
    assert pidfd is not None
    os.close(pidfd)
    init.close()


async def test_init_holds_neither_the_link_nor_the_output_of_its_worker(
    tested: WorkersUnderTest,
) -> None:
    await guest(tested, "pass")
    init = parent(tested.workers.pids()["guest"])
    open_there = list(held_by(init).values())
    assert sorted(set(map(kind_of, open_there))) == ["/dev/null", "pipe", "socket"]
    assert sum(kind_of(each) == "socket" for each in open_there) == 1
    assert len({each for each in open_there if kind_of(each) == "pipe"}) == 1, "its own alarm"


HOLDS_NOTHING = """
import resource
assert os.getsid(0) == os.getpid()
assert resource.getrlimit(resource.RLIMIT_FSIZE) == (1 << 30, 1 << 30)
assert not [name for name in sys.modules if name.startswith('nondum.host')]
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
