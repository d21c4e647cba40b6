"""Users of the machine that are workers' alone, and how sandboxes and scratch folders get them.

Writing a map of users takes a process that may be any (user_namespaces(7)). A mount that has one
shows the files of one user as those of another (mount_setattr(2), Linux 5.12).
"""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager

from nondum.host.sandbox.inside import kernel

OF_ROOT = range(61184, 65520)
"""For a daemon that is root: those that systemd gives out likewise (DynamicUser=)."""
OF_SERVICE = range(69632, 73968)
"""For a daemon that is not: neither systemd nor shadow gives these out (systemd.io/UIDS-GIDS), so
that it gets no power over the processes of other services."""
MADE_S = 10.0
"""How long a process may take to make a user namespace, which its owner may have stopped: less than
the process that waits for it has (`server.DRIVE_S`)."""
_MESSAGE_BYTES = 16


def map_namespace_of_root(process: int) -> None:
    """Map root, the users of workers and the groups of devices in the new user namespace of a
    process, which is given by a descriptor of its folder in /proc. Raises `OSError`."""
    _write(process, "uid_map", f"0 0 1\n{_same(OF_ROOT)}")
    _write(process, "gid_map", f"0 0 {OF_ROOT.stop}\n")  # dialout, video, …


def map_namespace(process: int, user: int, group: int) -> None:
    """Map the maker of a new user namespace, as its root, and the users of workers in it.

    Its processes keep the maker's other groups, which they may not leave. Raises `OSError`.
    """
    _write(process, "setgroups", "deny")
    _write(process, "uid_map", f"0 {user} 1\n{_same(OF_SERVICE)}")
    _write(process, "gid_map", f"0 {group} 1\n{_same(OF_SERVICE)}")


def map_folder(mount: int, owner: tuple[int, int], user: int) -> None:
    """Have a mount that is not in place yet (open_tree(2)) show the files of `owner`, a user and a
    group, as those of `user`. Files of other users show the overflow user there (65534).
    No set-id bits, no devices.

    Raises `OSError`: the file system cannot do that, or the mount is in place.
    """
    with namespace(owner, user) as ids:
        kernel.map_mount(mount, ids)


@contextmanager
def namespace(owner: tuple[int, int], user: int) -> Iterator[int]:
    """A user namespace in which the owner is called as it is, and is another user outside.

    The owner makes it, so that the kernel counts it as one of theirs. The process that calls has no
    other thread: a lock that one held would stay locked in the fork. Raises `OSError`.
    """
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        maker = os.fork()
        if maker == 0:
            ours.close()
            _make(theirs, owner)
        theirs.close()
        ours.settimeout(MADE_S)
        try:
            _, descriptors, _, _ = socket.recv_fds(ours, _MESSAGE_BYTES, 1)
            if not descriptors:
                raise PermissionError("no user namespace can be made")
            process = opened(maker)
            try:
                _write(process, "uid_map", f"{owner[0]} {user} 1")
                _write(process, "gid_map", f"{owner[1]} {user} 1")
                yield descriptors[0]
            finally:
                os.close(process)
                os.close(descriptors[0])
        finally:
            os.kill(maker, signal.SIGKILL)  # the only one that a stopped process heeds
            os.waitpid(maker, 0)


def _make(told: socket.socket, owner: tuple[int, int]) -> None:
    """In the forked process: make the namespace, and stay until it is killed, or its parent has
    ended. Does not return."""
    try:
        os.setgroups([])
        os.setresgid(owner[1], owner[1], owner[1])
        # Not dumpable any more: the owner cannot look into a copy of this process's memory.
        os.setresuid(owner[0], owner[0], owner[0])
        kernel.unshare(kernel.CLONE_NEWUSER)
        own = os.open("/proc/self/ns/user", os.O_RDONLY)
        socket.send_fds(told, [b"made"], [own])
        told.recv(_MESSAGE_BYTES)
    finally:
        os._exit(0)


def opened(pid: int) -> int:
    """A descriptor of the folder of a process in /proc: not of one that has its id later.

    Raises `OSError`.
    """
    return os.open(f"/proc/{pid}", os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)


def _same(ids: range) -> str:
    return f"{ids.start} {ids.start} {len(ids)}\n"


def _write(process: int, name: str, text: str) -> None:
    """All at once: a map is written once (user_namespaces(7))."""
    descriptor = os.open(name, os.O_WRONLY | os.O_CLOEXEC, dir_fd=process)
    try:
        os.write(descriptor, text.encode())
    finally:
        os.close(descriptor)
