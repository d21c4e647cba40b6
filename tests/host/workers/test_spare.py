"""The interpreter that waits to become a worker: loaded ahead, like any other, never left over."""

from __future__ import annotations

import asyncio
import errno
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from tests.host.workers.trees import CountedTree
from tests.kit.processes import is_alive, until_gone
from tests.kit.until import PATIENCE_S, until_async
from tests.kit.workers import SDK, WorkersUnderTest

from nondum.host.sandbox.cgroups.groups import Cgroups, NoTree
from nondum.host.sandbox.inside.bootstrap import PRELOADED
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.workers.confinement import Entry
from nondum.host.workers.launcher import MARK, WorkerLauncher, owner_mark
from nondum.host.workers.leftovers import end_leftovers
from nondum.host.workers.spare import OWNER, Spare
from nondum.host.workers.spec import WorkerSpec, base_interpreter
from nondum.host.workers.unconfined import Unconfined
from nondum.sdk.errors import WorkerFailed

pytestmark = pytest.mark.anyio

QUIET = "X = 1\n"
FORKING = (
    "import os, time\n"
    "if os.fork() == 0:\n"
    "    os.setsid()\n"
    "    open('child', 'w').write(str(os.getpid()))\n"
    "    while True: time.sleep(1)\n"
    "while not os.path.exists('child') or not open('child').read(): time.sleep(0.01)\n"
)

TELLS_PATH = "import sys; open('path', 'w').write('\\n'.join(sys.path))\n"


def spare_of(tested: WorkersUnderTest) -> int:
    launcher = tested.workers.launcher
    assert isinstance(launcher, WorkerLauncher)
    assert launcher.spare_pid is not None
    return launcher.spare_pid


def environment(pid: int) -> dict[str, str]:
    pairs = Path(f"/proc/{pid}/environ").read_bytes().decode().split("\0")
    return {name: value for name, _, value in (pair.partition("=") for pair in pairs) if name}


def ancestors(pid: int) -> set[int]:
    """A process and its ancestors: in a sandbox, also the init, and what makes the sandbox."""
    found = set()
    while pid > 1:
        found.add(pid)
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        pid = int(fields[1])
    return found


def place(pid: int) -> Path:
    return Path(f"/proc/{pid}/cwd").readlink()


async def test_the_spare_becomes_the_next_worker(tested: WorkersUnderTest) -> None:
    await tested.workers.keep_spare()
    spare = spare_of(tested)
    await tested.start("cam", QUIET)
    assert spare in ancestors(tested.workers.pids()["cam"])
    await tested.start("cam-2", QUIET)
    assert spare not in ancestors(tested.workers.pids()["cam-2"])


async def test_only_the_standard_library_and_its_own_packages_are_to_be_found(
    tmp_path: Path,
) -> None:
    tested = WorkersUnderTest(tmp_path, confinement=Unconfined())
    try:
        spec = await tested.start("cam", TELLS_PATH)
    finally:
        await tested.workers.close()
    bare = "import sys; print(*sys.path, sep='\\n')"
    command = [str(spec.python), "-I", "-S", "-c", bare]
    standard = await asyncio.to_thread(lambda: subprocess.check_output(command, text=True))
    told = (spec.scratch / "path").read_text(encoding="utf-8")
    assert told.splitlines() == [*standard.splitlines(), *map(str, spec.site_packages)]


def test_one_that_ends_instead_of_asking_for_its_scratch_folder_is_no_worker() -> None:
    spare = Spare(Unconfined(), Unconfined().ground(None))
    try:
        spare.popen.kill()
        with pytest.raises(ConnectionResetError):
            spare.map_scratch(61184, PATIENCE_S)
    finally:
        spare.close()


def test_one_that_does_not_come_to_ask_for_its_scratch_folder_is_waited_for_so_long_only() -> None:
    spare = Spare(Unconfined(), Unconfined().ground(None))
    try:
        spare.popen.send_signal(signal.SIGSTOP)
        with pytest.raises(TimeoutError):
            spare.map_scratch(61184, startup_s=0.01)
    finally:
        spare.close()


async def test_a_worker_that_was_a_spare_has_the_usual_folder_and_environment(
    tested: WorkersUnderTest,
) -> None:
    await tested.workers.keep_spare()
    spec = await tested.start("cam", "import os; print(os.getcwd(), dict(os.environ))\n")
    pid = tested.workers.pids()["cam"]
    assert environment(pid)[MARK] == str(spec.scratch)
    assert place(pid) == spec.scratch
    (line,) = tested.lines("cam")
    assert line.startswith(f"{spec.scratch} ")
    assert f"'HOME': '{spec.scratch}'" in line
    assert "'OMP_NUM_THREADS': '1'" in line
    assert "NONDUM_PLACEHOLDER" not in line


async def test_what_a_spare_forks_is_found(tested: WorkersUnderTest) -> None:
    await tested.workers.keep_spare()
    spec = await tested.start("cam", FORKING)
    forked = tested.pid("cam", (spec.scratch / "child").read_text())
    assert is_alive(forked)
    assert end_leftovers(spec.scratch) >= 1
    await until_gone(forked)


async def test_a_spare_that_died_is_not_missed(tested: WorkersUnderTest) -> None:
    await tested.workers.keep_spare()
    spare = spare_of(tested)
    os.kill(spare, signal.SIGKILL)
    await asyncio.to_thread(os.waitid, os.P_PID, spare, os.WEXITED | os.WNOWAIT)
    await tested.start("cam", QUIET)
    assert spare not in ancestors(tested.workers.pids()["cam"])


async def test_a_worker_that_cannot_be_watched_is_ended(tested: WorkersUnderTest) -> None:
    """The last descriptor that there is would have told of its end (pidfd_open(2))."""
    spec = await tested.start("cam", QUIET)  # whose user is known by now
    await tested.workers.stop("cam")
    await tested.workers.keep_spare()
    spare = spare_of(tested)
    launcher = tested.workers.launcher
    ours, theirs = socket.socketpair()
    with ours, theirs, no_descriptors_left(), pytest.raises(WorkerFailed) as failed:
        await launcher.launch(spec, theirs)
    assert failed.value.code == "LAUNCH_FAILED"
    assert os.strerror(errno.EMFILE) in str(failed.value)
    assert not is_alive(spare)


@contextmanager
def no_descriptors_left() -> Iterator[None]:
    """Nothing more can be opened by this process."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    with ExitStack() as stack:
        highest = max(int(entry.name) for entry in Path("/proc/self/fd").iterdir())
        while (filled := os.open(os.devnull, os.O_RDONLY)) <= highest:
            stack.callback(os.close, filled)
        os.close(filled)
        resource.setrlimit(resource.RLIMIT_NOFILE, (filled, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)


async def test_an_unused_spare_ends_with_the_workers(tested: WorkersUnderTest) -> None:
    await tested.workers.keep_spare()
    spare = spare_of(tested)
    await tested.workers.close()
    assert not is_alive(spare)


def loaded(*names: str) -> set[str]:
    """Modules of the standard library that imports have loaded in a bare interpreter."""
    libraries = [str(SDK), *(path for path in sys.path if path.endswith("site-packages"))]
    program = (
        f"import sys; sys.path += {libraries!r}\n"
        f"for name in {names!r}: __import__(name)\n"
        "print(*(n for n in sys.modules if n.partition('.')[0] in sys.stdlib_module_names))\n"
    )
    command = [str(base_interpreter()), "-I", "-S", "-c", program]
    return set(subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())


def test_what_is_loaded_ahead_is_what_workers_need() -> None:
    assert loaded(*PRELOADED, "nondum.sdk.worker") == loaded(*PRELOADED)
    assert set(PRELOADED) <= loaded("nondum.sdk.worker")


class SlowTree(NoTree):
    """Puts no process anywhere, until it is let."""

    def __init__(self) -> None:
        self.is_asked = threading.Event()
        self.may_go_on = threading.Event()

    def add(self, name: str, pid: int) -> None:
        """As slow as a kernel that waits for its other processors."""
        self.is_asked.set()
        assert self.may_go_on.wait(PATIENCE_S)


async def test_other_workers_go_on_while_a_process_is_put_into_a_control_group(
    tested: WorkersUnderTest,
) -> None:
    tree = SlowTree()
    tested.workers.launcher = WorkerLauncher(tested.confinement, Cgroups(tree))
    starting = asyncio.create_task(tested.start("cam", QUIET))
    await asyncio.to_thread(tree.is_asked.wait, PATIENCE_S)
    assert not starting.done()
    tree.may_go_on.set()
    await starting
    assert "cam" in tested.workers.pids()


async def test_start_that_is_not_wanted_any_more_leaves_no_process(
    tested: WorkersUnderTest,
) -> None:
    tree = SlowTree()
    launcher = WorkerLauncher(tested.confinement, Cgroups(tree), tested.folder)
    warming = asyncio.create_task(launcher.warm())
    await asyncio.to_thread(tree.is_asked.wait, PATIENCE_S)
    processes = await until_async("an environment to know it by", lambda: spares(tested.folder))
    warming.cancel()
    tree.may_go_on.set()
    await asyncio.wait([warming])
    assert warming.cancelled()
    for process in processes:
        await until_gone(process)
    assert launcher.spare_pid is None


class ShownScratch(Entry):
    """Its scratch folder is to be shown as another user's."""

    @property
    def maps_scratch(self) -> bool:
        """It is, without a sandbox for that."""
        return True


class Showing(Unconfined):
    """Waits for a mount of the scratch folder."""

    @contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """The same worker."""
        with super().entry(spec, ground) as entry:
            yield ShownScratch(entry.restrictions, user=os.geteuid())


async def test_launch_that_is_not_wanted_any_more_while_it_waits_for_a_mount_leaves_nothing(
    tested: WorkersUnderTest,
) -> None:
    tree = CountedTree()
    launcher = WorkerLauncher(Showing(), Cgroups(tree), startup_s=PATIENCE_S)
    await launcher.warm()
    spare = launcher.spare_pid
    assert spare is not None
    os.kill(spare, signal.SIGSTOP)  # it will not say anything
    tree.is_limited.clear()
    ours, theirs = socket.socketpair()
    with ours, theirs:
        launching = asyncio.create_task(launcher.launch(tested.spec("cam", QUIET), theirs))
        await asyncio.to_thread(tree.is_limited.wait, PATIENCE_S)
        launching.cancel()
        await asyncio.wait([launching])
    try:
        assert launching.cancelled()
        assert not is_alive(spare)
        assert not tree.names()
    finally:
        if is_alive(spare):
            os.kill(spare, signal.SIGKILL)


def spares(scratches: Path) -> list[int]:
    """Interpreters that wait to become workers of a daemon, and what makes their sandboxes."""
    return [int(each.name) for each in Path("/proc").glob("[0-9]*") if is_spare(each, scratches)]


def is_spare(process: Path, scratches: Path) -> bool:
    try:
        about = environment(int(process.name))
    except OSError:
        return False
    return about.get(OWNER) == owner_mark(scratches)
