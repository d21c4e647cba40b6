"""Sandboxes and scratch folders of the served user get users of workers, and nothing else does."""

from __future__ import annotations

import fcntl
import os
import pwd
import signal
import socket
import stat
import struct
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.host.sandbox.helper.replies import code
from tests.kit.golden import Golden
from tests.sandbox.guests import open_folder

from nondum.host.sandbox.cgroups.groups import NoTree
from nondum.host.sandbox.helper import requests, worker_users
from nondum.host.sandbox.helper.device_nodes import Nodes
from nondum.host.sandbox.helper.disks import Disks
from nondum.host.sandbox.helper.lamps import Lamps
from nondum.host.sandbox.helper.requests import Request
from nondum.host.sandbox.helper.server import answer
from nondum.host.sandbox.helper.service import Service
from nondum.host.sandbox.helper.stop_key import PressesOfDevice
from nondum.host.sandbox.helper.worker_users import OF_ROOT, OF_SERVICE
from nondum.host.sandbox.inside import kernel
from nondum.host.sandbox.levels import refusals
from nondum.sdk.errors import NondumError

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="the helper is root's")
SERVED, STRANGER = pwd.getpwnam("daemon"), pwd.getpwnam("nobody")
WORKER = OF_SERVICE.start + 7
NS_GET_OWNER_UID = 0xB704
"""See ioctl_nsfs(2)."""
OTHERS = [0, 1, SERVED.pw_uid, OF_ROOT.start, OF_SERVICE.start - 1, OF_SERVICE.stop]


@pytest.fixture
def folder() -> Iterator[Path]:
    """One of the user who is served, on a disk."""
    with open_folder() as folder:
        os.chown(folder, SERVED.pw_uid, SERVED.pw_gid)
        yield folder


@pytest.fixture
def root(tmp_path: Path) -> Service:
    def no_key() -> PressesOfDevice:
        raise requests.refused("there is none")

    nodes, lamps = Nodes(tmp_path, SERVED.pw_uid), Lamps((), tmp_path)
    return Service(SERVED.pw_uid, tmp_path, Disks(), nodes, NoTree(), lambda: lamps, no_key)


@contextmanager
def process_of(user: int, flags: int = kernel.CLONE_NEWUSER) -> Iterator[int]:
    """A process of a user that has made namespaces."""
    read, write = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            os.setgroups([])
            os.setresgid(user, user, user)
            os.setresuid(user, user, user)
            kernel.prctl(kernel.PR_SET_DUMPABLE, 1)
            if flags:
                kernel.unshare(flags)
            os.write(write, b"!")
            signal.pause()
        finally:
            os._exit(0)
    os.close(write)
    assert os.read(read, 1)
    os.close(read)
    try:
        yield pid
    finally:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)


def map_of(pid: int, name: str) -> list[list[int]]:
    lines = Path(f"/proc/{pid}/{name}").read_text(encoding="ascii").splitlines()
    return [[int(number) for number in line.split()] for line in lines]


def refused(ask: Callable[[], object]) -> str:
    with pytest.raises(NondumError) as error:
        ask()
    assert error.value.code == "HELPER_REFUSED"
    return error.value.problems[0].message


def test_namespace_of_the_served_user_maps_it_and_the_users_of_workers(root: Service) -> None:
    with process_of(SERVED.pw_uid) as pid:
        root.serve(requests.MapUsers(pid))
        same = [OF_SERVICE.start, OF_SERVICE.start, len(OF_SERVICE)]
        assert map_of(pid, "uid_map") == [[0, SERVED.pw_uid, 1], same]
        assert map_of(pid, "gid_map") == [[0, SERVED.pw_gid, 1], same]
        assert Path(f"/proc/{pid}/setgroups").read_text() == "deny\n"
        with pytest.raises(PermissionError):
            root.serve(requests.MapUsers(pid))


@pytest.mark.parametrize("user", [0, STRANGER.pw_uid])
def test_namespaces_of_other_users_are_left_alone(root: Service, user: int, golden: Golden) -> None:
    with process_of(user) as pid:
        golden.check("a foreign process", refused(lambda: root.serve(requests.MapUsers(pid))))
        assert map_of(pid, "uid_map") == []


@pytest.mark.parametrize("pid", [0, 1])
def test_users_are_not_mapped_for_processes_of_the_system(
    root: Service, pid: int, golden: Golden
) -> None:
    golden.check("a foreign process", refused(lambda: root.serve(requests.MapUsers(pid))))


def test_process_without_a_namespace_of_its_own_gets_no_map(root: Service) -> None:
    with process_of(SERVED.pw_uid, flags=0) as pid, pytest.raises(OSError):
        root.serve(requests.MapUsers(pid))


def test_neither_systemd_nor_shadow_gives_out_users_of_the_service_s_workers() -> None:
    assert set(OF_SERVICE).isdisjoint({*range(65536), *range(100_000, 600_100_000, 65536)})
    assert OF_SERVICE.stop <= 100_000, "where subordinate ids begin (login.defs(5))"


def mapped(root: Service, place: Path, user: int = WORKER) -> Path:
    """A mount of a folder that was mapped, as it is seen at once."""
    mount = kernel.copy_mount(str(place))
    root.serve(requests.MapFolder(user), mount)
    return Path(f"/proc/self/fd/{mount}")


def test_files_of_the_one_who_is_served_are_shown_as_the_workers(
    root: Service, folder: Path
) -> None:
    for name, owner in (("own", SERVED.pw_uid), ("of-root", 0), ("of-a-worker", WORKER)):
        (folder / name).write_text("x")
        os.chown(folder / name, owner, owner)
    shown = mapped(root, folder)
    assert shown.stat().st_uid == WORKER
    owners = {name: (shown / name).stat() for name in ("own", "of-root", "of-a-worker")}
    assert {name: (of.st_uid, of.st_gid) for name, of in owners.items()} == {
        "own": (WORKER, WORKER),
        "of-root": (65534, 65534),
        "of-a-worker": (65534, 65534),
    }
    with pytest.raises(OSError):
        os.chmod(shown / "of-root", 0o4777)  # noqa: PTH101
    flags = os.statvfs(shown).f_flag
    assert flags & os.ST_NOSUID and flags & os.ST_NODEV


def test_what_the_worker_writes_is_the_daemons_on_the_disk(root: Service, folder: Path) -> None:
    shown = mapped(root, folder)
    touch = ["sh", "-c", "echo x > new && mkdir -m 0 inner && id -u"]
    subprocess.run(touch, cwd=shown, user=WORKER, group=WORKER, extra_groups=[], check=True)
    for name in ("new", "inner"):
        found = (folder / name).stat()
        assert (found.st_uid, found.st_gid) == (SERVED.pw_uid, SERVED.pw_gid)


@pytest.mark.parametrize("user", OTHERS)
def test_users_that_are_no_workers_are_not_given(
    root: Service, folder: Path, user: int, golden: Golden
) -> None:
    golden.check("a foreign user", refused(lambda: mapped(root, folder, user)), user=user)
    node = requests.PutNode("eye", "line", 188, 0, user)
    golden.check("a foreign user", refused(lambda: root.serve(node)), user=user)


def test_folders_of_other_users_are_not_mapped(root: Service, folder: Path, golden: Golden) -> None:
    os.chown(folder, STRANGER.pw_uid, STRANGER.pw_gid)
    golden.check("a foreign folder", refused(lambda: mapped(root, folder)))


def test_other_things_are_not_mapped(root: Service, folder: Path, golden: Golden) -> None:
    (folder / "file").write_text("x")
    os.chown(folder / "file", SERVED.pw_uid, SERVED.pw_gid)
    golden.check("a foreign folder", refused(lambda: mapped(root, folder / "file")))


def test_mount_that_is_in_place_stays_as_it_is(root: Service, folder: Path) -> None:
    at = os.open(folder, os.O_PATH)
    with pytest.raises(OSError):
        root.serve(requests.MapFolder(WORKER), at)
    os.close(at)
    assert folder.stat().st_uid == SERVED.pw_uid


def test_namespaces_of_maps_count_as_those_of_the_one_who_is_served() -> None:
    owner = bytearray(4)
    with worker_users.namespace((SERVED.pw_uid, SERVED.pw_gid), WORKER) as namespace:
        fcntl.ioctl(namespace, NS_GET_OWNER_UID, owner)
    assert struct.unpack("=I", owner) == (SERVED.pw_uid,)


def test_namespace_that_the_kernel_does_not_make_is_told() -> None:
    refused = refusals.filter_of({"all": refusals.GROUPS["namespaces"]}, refusals.machine())
    pid = os.fork()
    if pid == 0:
        kernel.filter_calls(refused)
        try:
            with worker_users.namespace((SERVED.pw_uid, SERVED.pw_gid), WORKER):
                os._exit(1)
        except PermissionError:
            os._exit(0)
        finally:
            os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0


def children() -> set[int]:
    """Of this process."""
    tasks = Path("/proc/self/task").iterdir()
    return {int(pid) for task in tasks for pid in (task / "children").read_text().split()}


def test_process_that_its_owner_has_stopped_is_not_left() -> None:
    before = children()
    with worker_users.namespace((SERVED.pw_uid, SERVED.pw_gid), WORKER):
        (maker,) = children() - before
        os.kill(maker, signal.SIGSTOP)
    assert children() == before


def test_process_that_is_stopped_before_it_has_made_one_is_not_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = children()
    monkeypatch.setattr(worker_users, "MADE_S", 0.1)
    monkeypatch.setattr(os, "setgroups", lambda _: os.kill(os.getpid(), signal.SIGSTOP))
    with (
        pytest.raises(TimeoutError),
        worker_users.namespace((SERVED.pw_uid, SERVED.pw_gid), WORKER),
    ):
        pass
    assert children() == before


def test_one_descriptor_comes_with_a_folder_and_none_with_anything_else(root: Service) -> None:
    read, write = os.pipe()
    cases: list[tuple[Request, int]] = [
        (requests.MapFolder(WORKER), 0),
        (requests.ListCgroups(), 1),
        (requests.MapUsers(os.getpid()), 1),
    ]
    for request, count in cases:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with ours, theirs:
            socket.send_fds(ours, [requests.encode(request)], [write] * count)
            assert code(answer(theirs, root)) == "HELPER_REFUSED", request
    os.close(write)
    assert os.read(read, 1) == b"", "no copy is kept"
    os.close(read)


def test_folder_that_comes_with_another_descriptor_is_not_mapped(
    root: Service, folder: Path
) -> None:
    mount = kernel.copy_mount(str(folder))
    request = requests.encode(requests.MapFolder(WORKER))
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        socket.send_fds(ours, [request], [mount, mount])
        assert code(answer(theirs, root)) == "HELPER_REFUSED"
        assert Path(f"/proc/self/fd/{mount}").stat().st_uid == SERVED.pw_uid
        socket.send_fds(ours, [request], [mount])
        assert not code(answer(theirs, root))
        assert Path(f"/proc/self/fd/{mount}").stat().st_uid == WORKER
    os.close(mount)


def test_node_belongs_to_the_user_of_the_worker_that_it_is_for(tmp_path: Path) -> None:
    hidraw, sys = "devices/usb1/1-2/1-2:1.0/hidraw/hidraw0", tmp_path / "sys"
    (sys / hidraw).mkdir(parents=True)
    (sys / "dev/char").mkdir(parents=True)
    (sys / "dev/char/240:3").symlink_to(sys / hidraw)
    nodes = Nodes(tmp_path / "run", SERVED.pw_uid, sys=sys)
    found = nodes.put("eye", "line", 240, 3, WORKER).stat()
    assert (found.st_uid, stat.S_IMODE(found.st_mode)) == (WORKER, 0o600)
