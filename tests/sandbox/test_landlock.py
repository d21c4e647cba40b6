"""Each right of Landlock's: what needs it is refused where no rule allows it, and nowhere else."""

from __future__ import annotations

import os
import shutil
import socket
from pathlib import Path

import pytest
from tests.host.sandbox.inside.child import told

from nondum.host.sandbox.levels import landlock

ABI = landlock.version()
NOT_ALLOWED = "EACCES"
DO = {
    "execute": "os.execv(f'{at}/program', ['program'])",
    "write a file": "open(f'{at}/file', 'r+')",
    "read a file": "open(f'{at}/file')",
    "list a folder": "os.listdir(at)",
    "remove a folder": "os.rmdir(f'{at}/folder')",
    "remove a file": "os.unlink(f'{at}/file')",
    "make a character device": "os.mknod(f'{at}/made', 0o20600, os.makedev(1, 3))",
    "make a folder": "os.mkdir(f'{at}/made')",
    "make a file": "os.mknod(f'{at}/made', 0o100600)",
    "make a socket": "os.mknod(f'{at}/made', 0o140600)",
    "make a pipe": "os.mkfifo(f'{at}/made')",
    "make a block device": "os.mknod(f'{at}/made', 0o60600, os.makedev(7, 0))",
    "make a link": "os.symlink('file', f'{at}/made')",
    "truncate a file": "os.truncate(f'{at}/file', 0)",
}
"""What needs just this right."""
OF_ROOT = {"make a character device", "make a block device"}
RESTRICTED = """
import fcntl, socket, termios
from nondum.host.sandbox.levels import landlock
allowed = {name: map(Path, given.get(name, ())) for name in ("readable", "writable")}
with landlock.ruleset(**allowed, has_network=given.get("has_network", False)) as ruleset:
    kernel.prctl(kernel.PR_SET_NO_NEW_PRIVS, 1)
    kernel.restrict_to(ruleset)
at = given.get("at")
"""


def folder(path: Path) -> Path:
    path.mkdir()
    (path / "folder").mkdir()
    (path / "file").write_text("text")
    shutil.copy(shutil.which("true") or "/bin/true", path / "program")
    return path


@pytest.mark.skipif(ABI < 3, reason="an older Landlock")
@pytest.mark.parametrize("right", DO)
def test_right_is_refused_outside_the_writable_folder_and_given_in_it(
    tmp_path: Path, right: str
) -> None:
    if right in OF_ROOT and os.geteuid() != 0:
        pytest.skip("needs root, to make devices")
    inside, outside = folder(tmp_path / "inside"), folder(tmp_path / "outside")
    given = {"writable": [str(inside)]}
    program = f"{RESTRICTED}tell(failure(lambda: {DO[right]}))"
    assert told(program, {**given, "at": str(outside)}) == NOT_ALLOWED
    if right != "execute":  # of which nothing would be told
        assert told(program, {**given, "at": str(inside)}) == ""


@pytest.mark.skipif(ABI < 5, reason="an older Landlock")
@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to make devices")
def test_device_that_may_be_read_only_is_not_controlled(tmp_path: Path) -> None:
    os.mknod(tmp_path / "null", 0o20666, os.makedev(1, 3))
    asks = "lambda: fcntl.ioctl(open(f'{at}/null'), termios.TCGETS, bytes(64))"
    given = {"at": str(tmp_path), "readable": [str(tmp_path)]}
    assert told(f"{RESTRICTED}tell(failure({asks}))", given) == NOT_ALLOWED


@pytest.mark.parametrize("node", ["null", "zero", "full", "random", "urandom"])
def test_device_that_everybody_needs_may_be_used(node: str) -> None:
    opens = f"lambda: open('/dev/{node}', 'r+b', buffering=0)"
    assert told(f"{RESTRICTED}tell(failure({opens}))", {}) == ""


def test_every_right_is_shown_to_matter() -> None:
    assert set(DO) | {"control a device"} == set(landlock.HANDLED)


TCP = {
    "bind": "socket.socket().bind(('127.0.0.1', 0))",
    "connect": "socket.socket().connect(('127.0.0.1', given['port']))",
}


@pytest.mark.skipif(ABI < 4, reason="an older Landlock")
@pytest.mark.parametrize("does", TCP)
def test_ports_need_the_network(does: str) -> None:
    program = f"{RESTRICTED}tell(failure(lambda: {TCP[does]}))"
    with socket.create_server(("127.0.0.1", 0)) as server:
        given = {"port": server.getsockname()[1]}
        assert told(program, given) == NOT_ALLOWED
        assert told(program, {**given, "has_network": True}) == ""


@pytest.mark.skipif(ABI < 6, reason="an older Landlock")
def test_abstract_sockets_of_other_processes_are_out_of_reach() -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(f"\0nondum-test-{os.getpid()}")
        server.listen()
        named = f"'\\0nondum-test-{os.getpid()}'"
        connects = f"lambda: socket.socket(socket.AF_UNIX).connect({named})"
        assert told(f"{RESTRICTED}tell(failure({connects}))", {}) == "EPERM"


@pytest.mark.skipif(ABI < 6, reason="an older Landlock")
def test_other_processes_are_not_signalled() -> None:
    assert told(f"{RESTRICTED}tell(failure(lambda: os.kill(os.getppid(), 0)))", {}) == "EPERM"


def test_ruleset_that_cannot_be_made_is_told() -> None:
    with pytest.raises(OSError, match="landlock_create_ruleset"):
        landlock._created(1 << 63, ABI, has_network=False)


def test_rule_that_cannot_be_added_is_told(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="landlock_add_rule"):
        landlock._allow(-1, tmp_path, landlock.READ)


def test_nothing_is_left_open(tmp_path: Path) -> None:
    before = descriptors()
    with landlock.ruleset(readable=(tmp_path,), writable=()):
        assert descriptors() == before + 1
    assert descriptors() == before


def descriptors() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())
