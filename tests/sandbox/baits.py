"""What there is on the host for a hostile plugin to reach, and a run of that plugin."""

from __future__ import annotations

import ctypes
import json
import os
import pty
import secrets
import socket
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tests.kit.workers import WorkersUnderTest
from tests.sandbox.escape import ATTEMPTS

from nondum.host.core.events.workers import WorkerLogged
from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.sandbox.inside import mounts
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spec import Limits
from nondum.sdk.errors import WorkerFailed

ESCAPE = Path(__file__).with_name("escape.py")
SMALL = Limits(memory_mb=256, tasks=100, descriptors=64, file_mb=16)
TOKEN = "nondum-bait"  # a word to look for
IPC_CREAT, IPC_EXCL = 0o1000, 0o2000  # sys/ipc.h
LEFT_WHEN_RESTRICTED = {
    *("be root", "know the host name", "see a process of the host"),
    *("open a device node that lies there", "take all instances of inotify"),
}
"""What is not hidden from restricted workers: names of processes can be seen, but nothing of what
they hold. It is root where the host is, and the interpreter is root's alone. It can make no device
node in its folders, but open one that lies there already."""

SHARED_MEMORY = {"take all memory as shared memory", "take all memory as files in memory"}
"""What only a memory cgroup limits."""


@dataclass(frozen=True)
class Result:
    """What one attempt came to."""

    could: bool
    what: str


def unlimited(folder: Path) -> set[str]:
    """What this machine does not limit, at any level."""
    return set() if "memory" in Cgroups.open(folder).holds else SHARED_MEMORY


@contextmanager
def laid(folder: Path, cgroup: str = "") -> Iterator[dict[str, Any]]:
    """Baits: files, sockets, a process, shared memory, a terminal."""
    with ExitStack() as stack:
        secret, other = folder / "secret", folder / "other"
        secret.write_text("of the host")
        (other / "site-packages").mkdir(parents=True)
        (other / "scratch").mkdir()
        code, scratch = other / "site-packages/secret.py", other / "scratch/notes"
        code.write_text("# of another payload")
        scratch.write_text("of another worker")
        listener = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        by_path = stack.enter_context(socket.socket(socket.AF_UNIX))
        by_path.bind(str(folder / "socket"))
        by_path.listen(16)
        by_name = stack.enter_context(socket.socket(socket.AF_UNIX))
        by_name.bind(f"\0{TOKEN}-{os.getpid()}")
        by_name.listen(16)
        for name in (str(folder / "datagrams"), f"\0{TOKEN}-{os.getpid()}-datagrams"):
            stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)).bind(name)
        process = stack.enter_context(_process())
        master, terminal = pty.openpty()
        stack.callback(os.close, master)
        stack.callback(os.close, terminal)
        shared_key = stack.enter_context(_shared_memory())
        stack.enter_context(_environment())
        mode = stat.S_IMODE(Path("/dev/full").stat().st_mode)
        stack.callback(os.chmod, "/dev/full", mode)
        tmp = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="nondum-bait-")))
        yield {
            "secret": str(secret),
            "victim": str(_victim(folder)),
            "folder": str(folder),
            "other_code": str(code),
            "other_scratch": str(scratch),
            "port": listener.getsockname()[1],
            "path_socket": str(folder / "socket"),
            "abstract_socket": f"{TOKEN}-{os.getpid()}",
            "path_datagrams": str(folder / "datagrams"),
            "abstract_datagrams": f"{TOKEN}-{os.getpid()}-datagrams",
            "pid": process.pid,
            "token": TOKEN,
            "session": os.getsid(0),
            "terminal": os.ttyname(terminal),
            "host_name": socket.gethostname(),
            "shared_key": shared_key,
            "tmp": str(tmp),
            "mode": mode ^ stat.S_IXOTH,  # which means nothing of a device
            "few_inotify_instances": mounts.INOTIFY_INSTANCES,
            "cgroup": cgroup,
        }


@contextmanager
def _process() -> Iterator[subprocess.Popen[str]]:
    """A process of the host's user. It holds no capabilities, as the service does not: those of
    root protect it from other processes of root."""
    program = (
        "import time\n"
        "from nondum.host.sandbox.inside import kernel\n"
        "kernel.keep_capabilities()\n"
        "print('ready', flush=True)\n"
        "time.sleep(600)"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, TOKEN],
        env={"TOKEN": TOKEN, "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


@contextmanager
def _environment() -> Iterator[None]:
    """A word in the environment of this process, which starts the workers."""
    os.environ["NONDUM_BAIT"] = TOKEN
    try:
        yield
    finally:
        del os.environ["NONDUM_BAIT"]


@contextmanager
def _shared_memory() -> Iterator[int]:
    """A segment of System V shared memory that everybody may attach (shmget(2)), by its key.

    Keys are the machine's: one that other tests may take too would end with theirs.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    key = secrets.randbelow(0x7FFFFFFF) + 1  # zero stands for no key
    identifier = libc.shmget(key, 4096, IPC_CREAT | IPC_EXCL | 0o666)
    assert identifier >= 0, os.strerror(ctypes.get_errno())
    try:
        yield key
    finally:
        libc.shmctl(identifier, 0, None)


async def attempted(
    folder: Path,
    bait: dict[str, Any],
    confinement: Confinement,
    attempts: Sequence[str] = (),
    limits: Limits = SMALL,
    cgroups: Cgroups | None = None,
) -> dict[str, Result]:
    """What the hostile plugin can do, or some of it, so confined; `cgroups` are the machine's, if
    none are given.

    A memory cgroup of Linux 4.19 and later ends the whole worker with an attempt to take memory
    that only it limits: the others are made by the next one.
    """
    left, results = list(attempts or ATTEMPTS), dict[str, Result]()
    cgroups = cgroups or Cgroups.open(folder)
    try:
        while left:
            place = folder / f"worker-{len(left)}"
            found = await _attempted(place, bait, confinement, left, limits, cgroups)
            results |= found
            left = left[len(found) :]
    finally:
        cgroups.close()
    return results


async def _attempted(
    folder: Path,
    bait: dict[str, Any],
    confinement: Confinement,
    attempts: Sequence[str],
    limits: Limits,
    cgroups: Cgroups,
) -> dict[str, Result]:
    """What one worker comes to, until the first attempt that ends it."""
    tested = WorkersUnderTest(folder, confinement=confinement)
    tested.workers.launcher = WorkerLauncher(confinement, cgroups)
    tested.workers.timing = replace(tested.timing, startup_s=120.0)
    source = ESCAPE.read_text(encoding="utf-8")
    summary = source.removeprefix('"""').partition("\n")[0]
    victim = _victim(folder)
    settings = {"bait": json.dumps({**bait, "victim": str(victim), "attempts": list(attempts)})}
    _lay_node(folder / "escape/scratch")
    ended = ""
    try:
        await tested.start("escape", source, summary=summary, settings=settings, limits=limits)
        await tested.until(WorkerLogged, lambda line: line.message == "tried all", timeout_s=120)
    except WorkerFailed as failed:
        ended = failed.code
    finally:
        await tested.workers.close(grace_s=1.0)
    said = [line.message for line in tested.told(WorkerLogged)]
    rows = [json.loads(s.removeprefix("tried ")) for s in said if s.startswith("tried {")]
    results = {row["name"]: judged(row) for row in rows}
    if ended:
        fatal = attempts[len(results)]
        assert ended == "WORKER_OOM" and fatal in SHARED_MEMORY, (ended, fatal)
        results[fatal] = Result(could=False, what=ended)
    return results


def _victim(folder: Path) -> Path:
    """A file for attempts to change, written as it was."""
    folder.mkdir(parents=True, exist_ok=True)
    victim = folder / "victim"
    victim.write_text("of the host, as it was")
    return victim


def _lay_node(scratch: Path) -> None:
    """A device node that any user may open, in the worker's own folder; where root runs the test.

    Nothing of the product would make one there.
    """
    scratch.mkdir(parents=True, mode=0o700)
    if os.geteuid() == 0:
        node = scratch / "node-of-before"
        os.mknod(node, stat.S_IFCHR, os.makedev(1, 5))  # /dev/zero
        node.chmod(0o666)


JUDGES: Mapping[str, Callable[..., bool]] = {
    "exists": lambda path: Path(path).exists(),
    "is set-id": lambda path: Path(path).stat().st_mode & 0o6000 != 0,
    "is empty": lambda path: Path(path).stat().st_size == 0,
    "has mode": lambda path, mode: stat.S_IMODE(Path(path).stat().st_mode) == mode,
    "was read": lambda path, at_s: Path(path).stat().st_atime == at_s,
    "has attribute": lambda path, name: name in os.listxattr(path),
}
"""What the host looks at, where a worker's own word does not count."""


def judged(row: dict[str, Any]) -> Result:
    """What an attempt came to, by its own word or, where that does not count, by looking."""
    if "judge" in row:
        judge, path, *more = row["judge"]
        if not (Path(path).exists() and JUDGES[judge](path, *more)):
            return Result(could=False, what="the host sees nothing of it")
    return Result(row["could"], row["what"])
