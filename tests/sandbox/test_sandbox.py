"""What is in a worker's sandbox: what it was granted, and nothing for longer than that."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import pty
import shutil
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.kit.processes import until_gone
from tests.kit.until import until_async
from tests.kit.workers import HOST, LIBRARIES, SDK, WorkersUnderTest
from tests.sandbox.guests import does, guest, open_folder, parent, status
from tests.sandbox.processes import children

from nondum.host.core.events.workers import WorkerLogged
from nondum.host.manager.state_folders import Folders, let_pass, make_private
from nondum.host.sandbox.levels import bubblewrap
from nondum.host.sandbox.levels.users import is_workers
from nondum.host.workers import granted_nodes
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held, user_for
from nondum.host.workers.unconfined import Unconfined

pytestmark = pytest.mark.anyio
needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to make devices")


@pytest.fixture(params=[False, *([True] if os.geteuid() == 0 else [])], ids=["shared", "own"])
async def tested(tmp_path: Path, request: pytest.FixtureRequest) -> AsyncIterator[WorkersUnderTest]:
    """Workers that share the host's user, and workers that have one each."""
    boxed = Boxed(shutil.which("bwrap") or "bwrap", has_users=request.param)
    tested = WorkersUnderTest(tmp_path, confinement=boxed)
    yield tested
    await tested.workers.close(grace_s=1.0)


@pytest.fixture
def line() -> Iterator[tuple[int, str]]:
    """A serial line: its far end, and the node of the near one."""
    far, near = pty.openpty()
    yield far, os.ttyname(near)
    for end in (far, near):
        with contextlib.suppress(OSError):
            os.close(end)


async def test_device_appears_and_vanishes_while_it_runs(
    tested: WorkersUnderTest, line: tuple[int, str]
) -> None:
    far, node = line
    await guest(
        tested,
        "assert os.listdir('/dev/nondum') == ([] if device is None else ['line'])\n"
        "if device is not None:\n"
        "    port = os.open(device.node, os.O_RDWR | os.O_NOCTTY)\n"
        "    os.write(port, b'hello')\n"
        "    os.close(port)",
    )
    assert await does(tested) == ""
    await tested.workers.attach("guest", "line", node, {})
    assert await does(tested) == ""
    assert await asyncio.to_thread(os.read, far, 5) == b"hello"
    await tested.workers.detach("guest", "line")
    assert await does(tested) == ""
    assert not [e for e in tested.told(WorkerLogged) if e.message.startswith("DEVICE_REFUSED")]


async def test_device_takes_the_place_of_the_one_before_it(
    tested: WorkersUnderTest, line: tuple[int, str]
) -> None:
    await guest(tested, "assert os.listdir('/dev/nondum') == ([] if device is None else ['line'])")
    for node in ("/dev/null", line[1]):
        await tested.workers.attach("guest", "line", node, {})
        assert await does(tested) == ""
    await tested.workers.detach("guest", "line")
    assert await does(tested) == ""


@pytest.fixture
def nodes() -> Iterator[Path]:
    """A folder among the devices of the machine, with one in it."""
    folder = Path(f"/dev/nondum-test-{os.getpid()}")
    folder.mkdir()
    try:
        os.mknod(folder / "null", 0o20666, os.makedev(1, 3))
        (folder / "null").chmod(0o666)
        yield folder
    finally:
        shutil.rmtree(folder)


@needs_root
async def test_device_has_its_own_name_too_whatever_folder_that_is_in(
    tested: WorkersUnderTest, nodes: Path
) -> None:
    body = f"assert os.path.exists('{nodes}/null') == (device is not None)"
    await guest(tested, body)
    assert await does(tested) == ""
    await tested.workers.attach("guest", "line", str(nodes / "null"), {})
    assert await does(tested) == ""
    await tested.workers.detach("guest", "line")
    assert await does(tested) == ""


@needs_root
@pytest.mark.parametrize("pattern", ["{}", "{}/null"])
async def test_permission_brings_folders_of_device_nodes(
    tested: WorkersUnderTest, monkeypatch: pytest.MonkeyPatch, nodes: Path, pattern: str
) -> None:
    monkeypatch.setattr(granted_nodes, "NODES", {"audio": (pattern.format(nodes),)})
    await guest(tested, f"open('{nodes}/null', 'w').close()", ("audio",))
    assert await does(tested) == ""


async def test_device_can_be_used_and_its_node_stays_as_it_is(
    tested: WorkersUnderTest, line: tuple[int, str]
) -> None:
    """Its owner, who may be the worker's user, could close it to everybody else."""
    before = mode(line[1])
    await guest(
        tested,
        "os.close(os.open(device.node, os.O_RDWR | os.O_NOCTTY))\n"
        "try:\n"
        "    os.chmod(device.node, 0o606)\n"
        "except OSError as error:\n"
        "    assert error.errno in (1, 30), error\n"
        "else:\n"
        "    assert False, 'it could'",
    )
    await tested.workers.attach("guest", "line", line[1], {})
    assert await does(tested) == ""
    assert mode(line[1]) == before


async def test_worker_writes_where_everybody_may(tested: WorkersUnderTest) -> None:
    await guest(tested, "for each in ('/tmp', '/dev/shm'):\n    open(f'{each}/x', 'w').close()")
    assert await does(tested) == ""


async def test_worker_has_the_umask_of_the_host(tested: WorkersUnderTest) -> None:
    before = os.umask(0o002)
    try:
        await guest(tested, "was = os.umask(0o022); os.umask(was); assert was == 0o002, oct(was)")
    finally:
        os.umask(before)
    assert await does(tested) == ""


async def test_only_devices_are_handed_in(tested: WorkersUnderTest, tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("of the host")
    await guest(tested, "assert os.listdir('/dev/nondum') == []")
    for node in (secret, tmp_path, Path("/dev/pts/no-such")):
        await tested.workers.attach("guest", "line", str(node), {})
        said = tested.told(WorkerLogged)[-1].message
        assert said.startswith("DEVICE_REFUSED"), said
        assert await does(tested) == ""


async def test_link_to_a_device_is_followed_outside(
    tested: WorkersUnderTest, tmp_path: Path, line: tuple[int, str]
) -> None:
    link = tmp_path / "by-id"
    link.symlink_to(line[1])
    await guest(tested, "os.close(os.open(device.node, os.O_RDWR | os.O_NOCTTY))")
    await tested.workers.attach("guest", "line", str(link), {})
    assert await does(tested) == ""


async def test_device_is_there_before_the_plugin_starts(
    tested: WorkersUnderTest, line: tuple[int, str]
) -> None:
    await tested.workers.attach("guest", "line", line[1], {})
    await guest(tested, "os.close(os.open('/dev/nondum/line', os.O_RDWR | os.O_NOCTTY))")
    assert await does(tested) == ""


CONNECT = "socket.create_connection(('127.0.0.1', {port}), 2).close()"


@pytest.mark.parametrize("make", [Boxed, Held], ids=["sandboxed", "restricted"])
async def test_network_is_a_permission(tmp_path: Path, make: type[Boxed] | type[Held]) -> None:
    confinement: Confinement = Boxed(shutil.which("bwrap") or "bwrap") if make is Boxed else Held()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        body = CONNECT.replace("{port}", str(listener.getsockname()[1]))
        for number, permissions in enumerate(((), ("network",))):
            tested = WorkersUnderTest(tmp_path / str(number), confinement=confinement)
            await guest(tested, body, permissions)
            assert (await does(tested) == "") is bool(permissions)
            await tested.workers.close()


async def test_network_is_not_the_sockets_of_other_programs(tested: WorkersUnderTest) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("\0nondum-of-another-program")
        listener.listen()
        body = "socket.socket(socket.AF_UNIX).connect('\\0nondum-of-another-program')"
        await guest(tested, body, ("network",))
        assert os.strerror(errno.EAFNOSUPPORT) in await does(tested)


async def test_permission_brings_its_device_nodes(
    tested: WorkersUnderTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(granted_nodes, "NODES", {"audio": ("/dev/kms*", "/dev/no-such")})
    body = "print('sees', sorted(n for n in os.listdir('/dev') if n.startswith('k')))"
    await guest(tested, body, ("audio",))
    assert await does(tested) == ""
    said = await tested.until(WorkerLogged, lambda event: event.message.startswith("sees"))
    assert said.message == "sees ['kmsg']"


async def test_orphans_in_a_sandbox_are_reaped(tested: WorkersUnderTest) -> None:
    await guest(
        tested,
        "if os.fork() == 0:\n"
        "    if os.fork() == 0:\n"
        "        os._exit(0)\n"
        "    os._exit(0)\n"
        "os.wait()\n"
        "while len([p for p in os.listdir('/proc') if p.isdigit()]) > 2:\n"
        "    await ctx.sleep(0.01)",
    )
    assert await does(tested) == ""
    init = parent(tested.workers.pids()["guest"])
    await until_async("its init waits again", lambda: is_at_rest(init))


def is_at_rest(pid: int) -> bool:
    """Whether it sleeps, however often one looks: what spins does so at times."""
    return all(status(pid)["State"].startswith("S") for _ in range(100))


async def test_sandbox_ends_with_its_worker(tested: WorkersUnderTest) -> None:
    body = (
        "if os.fork() == 0:\n"
        "    os.setsid()\n"
        "    print('child', os.getpid(), flush=True)\n"
        "    os.execve('/usr/bin/sleep', ['sleep', '600'], {})\n"
        "await ctx.sleep(600)"
    )
    await guest(tested, body)
    tested.behave("guest", "do", u=f"{HOST}__guest__it")
    await tested.until(WorkerLogged, lambda event: event.message.startswith("child"))
    init = parent(tested.workers.pids()["guest"])
    others = children(init)
    await tested.workers.stop("guest")
    for pid in (init, *others):
        await until_gone(pid)


PLAIN_FILES = """
import dbm.dumb, pathlib, shutil, sqlite3, tarfile, tempfile, zipfile
here = pathlib.Path.cwd()
one = here / 'one'
one.write_text('text')
for copy in (shutil.copy, shutil.copy2, shutil.copyfile):
    assert pathlib.Path(copy(one, here / copy.__name__)).read_text() == 'text'
shutil.copy2(os.__file__, here / 'of the system')
one.chmod(0o600)
one.touch()
(here / 'touched').touch()
assert (here / 'touched').exists()
subprocess.run(['touch', here / 'touched by a program'], check=True)
os.utime(one, (1e9, 1e9))
(here / 'tree/inner').mkdir(parents=True)
shutil.copy(one, here / 'tree/inner')
shutil.copytree(here / 'tree', here / 'copied')
shutil.move(here / 'copied', here / 'moved')
with tempfile.TemporaryDirectory() as folder, tempfile.NamedTemporaryFile() as file:
    shutil.make_archive(folder + '/packed', 'gztar', here / 'tree')
    shutil.unpack_archive(folder + '/packed.tar.gz', here / 'unpacked')
    with tarfile.open(folder + '/packed.tar.gz') as archive:
        archive.extractall(here / 'extracted')
    with zipfile.ZipFile(file, 'w') as archive:
        archive.write(one, 'one')
    shutil.unpack_archive(file.name, here / 'unzipped', 'zip')
assert (here / 'unpacked/inner/one').read_text() == 'text'
with sqlite3.connect(here / 'base') as base:
    base.execute('pragma journal_mode=wal')
    base.execute('create table t (x)')
with dbm.dumb.open(str(here / 'dumb'), 'c') as base:
    base['x'] = 'y'
with open(one, 'r+') as file:
    file.truncate(1)
os.nice(1)
os.sched_setaffinity(0, os.sched_getaffinity(0))
shutil.rmtree(here / 'moved')
assert not (here / 'moved').exists()
"""


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(lambda: Boxed(shutil.which("bwrap") or "bwrap"), id="sandboxed"),
        pytest.param(lambda: Held(without=["user"]), id="restricted, the host's user"),
        pytest.param(lambda: Held(without=["user"], abi=2), id="the same, Landlock of Linux 5.19"),
        pytest.param(Unconfined, id="none"),
    ],
)
async def test_plain_files_can_be_worked_with(
    tmp_path: Path, make: Callable[[], Confinement]
) -> None:
    tested = WorkersUnderTest(tmp_path, confinement=make())
    await guest(tested, PLAIN_FILES)
    assert await does(tested) == ""
    await tested.workers.close()


IN_A_NAMESPACE = """
import os, shutil, subprocess, sys
from nondum.host.sandbox.inside import kernel, mounts

folder, place = sys.argv[1:]
kernel.unshare(kernel.CLONE_NEWNS)
kernel.mount(None, "/", None, kernel.MS_SLAVE | 1 << 14)  # MS_REC
kernel.mount("tmpfs", folder, "tmpfs", 0, "mode=755")  # neither nosuid nor nodev
shutil.copy(shutil.which("id"), f"{folder}/id")
os.chmod(f"{folder}/id", 0o4755)
os.mknod(f"{folder}/zero", 0o20666, os.makedev(1, 5))
mounts.bind(folder, place)
for at in (folder, place):
    said = subprocess.run([f"{at}/id", "-u"], user=65534, group=65534, capture_output=True)
    try:
        os.close(os.open(f"{at}/zero", os.O_RDONLY))
        opened = "opens"
    except PermissionError:
        opened = "does not open"
    print(said.stdout.decode().strip(), opened)
"""


def test_what_lies_in_its_folders_is_no_device_and_has_no_set_id_bits() -> None:
    """However it came to lie there. Of a folder for which bubblewrap has done nothing yet."""
    with open_folder() as folder, open_folder() as place:
        told = subprocess.run(
            [sys.executable, "-c", IN_A_NAMESPACE, str(folder), str(place)],
            capture_output=True,
            text=True,
            check=True,
        )
    before, in_the_sandbox = told.stdout.splitlines()
    assert before == "0 opens"
    assert in_the_sandbox == "65534 does not open"


async def test_worker_may_name_its_user_and_not_leave_its_groups(tested: WorkersUnderTest) -> None:
    body = (
        "os.setuid(os.getuid())\n"
        "os.setgid(os.getgid())\n"
        "os.chown('.', os.getuid(), os.getgid())\n"
        "assert open('/proc/self/setgroups').read() == 'deny\\n'"
    )
    await guest(tested, body)
    assert await does(tested) == ""


async def test_outside_is_not_told_by_what_a_worker_is(tested: WorkersUnderTest) -> None:
    body = (
        "assert os.getuid() == os.getgid() == 65534\n"
        "assert os.environ['HOME'] == os.getcwd() == str(ctx.scratch)\n"
        "import pwd\n"
        "assert pwd.getpwuid(os.getuid()).pw_dir == str(ctx.scratch)\n"
        "import grp\n"
        "assert grp.getgrgid(os.getgid()).gr_name == 'worker'\n"
        "assert socket.gethostname() == 'worker'\n"
        "assert not os.path.exists('/home') and not os.path.exists('/var')\n"
        "assert sorted(os.listdir('/dev')) == sorted(['core', 'fd', 'full', 'nondum', 'null',"
        " 'ptmx', 'pts', 'random', 'shm', 'stderr', 'stdin', 'stdout', 'tty', 'urandom', 'zero'])"
    )
    await guest(tested, body)
    assert await does(tested) == ""


def mode(node: str) -> int:
    return Path(node).stat().st_mode


async def test_worker_of_root_gets_a_user_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where all may read what it needs: Debian's interpreter, unlike one in root's home."""
    monkeypatch.setattr(bubblewrap, "prefixes", lambda: (Path("/usr/lib"),))
    with open_folder() as root:
        make_private(folders := Folders(root))
        let_pass(folders)
        folder = folders.scratches
        tested = WorkersUnderTest(folder, confinement=Held())
        source = "import os; print('users', os.getuid(), os.getgroups(), os.stat('.').st_uid)"
        spec = tested.spec("guest", source)
        site = spec.site_packages[0]
        for package in (SDK / "nondum", LIBRARIES / "pluggy", LIBRARIES / "msgpack"):
            shutil.copytree(package, site / package.name)  # where they are, not all may read
        spec = replace(spec, site_packages=(site,), python=Path("/usr/bin/python3"))
        await tested.workers.start(spec)
        said = await tested.until(WorkerLogged, lambda event: event.message.startswith("users"))
        user = user_for(spec)
        await tested.workers.close()
    assert user is not None and is_workers(user)
    assert said.message == f"users {user} [] {user}"
