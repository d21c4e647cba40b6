"""Landlock: which files a process that has nothing else around it may reach.

The ruleset is made by the host and handed over as a descriptor; the worker takes it on
(`nondum.host.sandbox.inside.restrict`). Sources: landlock(7), linux/landlock.h.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import struct
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

_CREATE, _ADD = 444, 445
"""landlock_create_ruleset and landlock_add_rule, the same on all architectures."""
_VERSION = 1
_PATH_BENEATH = 1
_NET_PORT_NEWEST = 4
"""The ABI from which TCP ports can be refused."""
TRUNCATES = 3
"""The ABI from which truncating a file is a separate right."""

EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
_TRUNCATE, IOCTL_DEVICE = 1 << 14, 1 << 15
HANDLED: Mapping[str, tuple[int, int]] = {
    "execute": (EXECUTE, 1),
    "write a file": (WRITE_FILE, 1),
    "read a file": (READ_FILE, 1),
    "list a folder": (READ_DIR, 1),
    "remove a folder": (1 << 4, 1),
    "remove a file": (1 << 5, 1),
    "make a character device": (1 << 6, 1),
    "make a folder": (1 << 7, 1),
    "make a file": (1 << 8, 1),
    "make a socket": (1 << 9, 1),
    "make a pipe": (1 << 10, 1),
    "make a block device": (1 << 11, 1),
    "make a link": (1 << 12, 1),
    "truncate a file": (_TRUNCATE, TRUNCATES),
    "control a device": (IOCTL_DEVICE, 5),
}
"""What is refused wherever no rule allows it → the right, and the ABI from which it can be. (That
of moving a file to another folder, 1 << 13, is refused by every ruleset, and never allowed here.)
"""
_BIND_TCP, _CONNECT_TCP = 1 << 0, 1 << 1
_ABSTRACT_SOCKETS, _SIGNALS = 1 << 0, 1 << 1
_FILES_ONLY = EXECUTE | WRITE_FILE | READ_FILE | _TRUNCATE | IOCTL_DEVICE
"""Rights that a rule for a file, and not a folder, may hold."""

READ = EXECUTE | READ_FILE | READ_DIR
DEVICE = READ_FILE | WRITE_FILE | IOCTL_DEVICE

_SYSTEM = (
    *("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/proc"),
    *("/etc/ld.so.cache", "/etc/ld.so.conf", "/etc/ld.so.conf.d", "/etc/alternatives"),
    *("/etc/localtime", "/etc/fonts", "/etc/mime.types", "/etc/passwd", "/etc/group"),
)
_OF_THE_NETWORK = (
    *("/etc/resolv.conf", "/etc/nsswitch.conf", "/etc/hosts", "/etc/host.conf", "/etc/gai.conf"),
    *("/etc/services", "/etc/protocols", "/etc/ssl", "/etc/ca-certificates", "/etc/pki"),
    "/run/systemd/resolve",
)
_NODES = tuple(f"/dev/{name}" for name in ("null", "zero", "full", "random", "urandom"))


def version() -> int:
    """The ABI that this kernel has; 0: no Landlock."""
    found: int = _syscall(_CREATE, None, 0, _VERSION)
    return max(found, 0)


@contextlib.contextmanager
def ruleset(
    *,
    readable: Iterable[Path],
    writable: Iterable[Path],
    nodes: Iterable[str] = (),
    has_network: bool = False,
    abi: int | None = None,
) -> Iterator[int]:
    """A ruleset's descriptor: the system and `readable` to read, `writable` to write.

    `nodes` are devices, or folders of them. What is not there is left out. Raises `OSError`.
    """
    abi = version() if abi is None else abi
    rights = sum(right for right, since in HANDLED.values() if since <= max(abi, 1))
    made = _created(rights, abi, has_network=has_network)
    try:
        system = (*_SYSTEM, *(_OF_THE_NETWORK if has_network else ()))
        for path in (*map(Path, system), *readable):
            _allow(made, path, READ & rights)
        for path in writable:
            _allow(made, path, rights)
        for node in (*_NODES, *nodes):
            _allow(made, Path(node), (DEVICE | READ_DIR) & rights)
        yield made
    finally:
        os.close(made)


def _created(rights: int, abi: int, *, has_network: bool) -> int:
    """`struct landlock_ruleset_attr`, as long as the ABI knows it."""
    ports = 0 if has_network or abi < _NET_PORT_NEWEST else _BIND_TCP | _CONNECT_TCP
    scoped = _ABSTRACT_SOCKETS | _SIGNALS
    size = 8 if abi < _NET_PORT_NEWEST else 16 if abi < 6 else 24
    attributes = struct.pack("=QQQ", rights, ports, scoped)[:size]
    return _checked(_syscall(_CREATE, attributes, size, 0), "landlock_create_ruleset")


def _allow(made: int, path: Path, rights: int) -> None:
    try:
        found = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        if not path.is_dir():
            rights &= _FILES_ONLY
        rule = struct.pack("=Qi", rights, found)
        _checked(_syscall(_ADD, made, _PATH_BENEATH, rule, 0), f"landlock_add_rule {path}")
    finally:
        os.close(found)


def _syscall(number: int, *arguments: int | bytes | None) -> int:
    libc = ctypes.CDLL(None, use_errno=True)
    given = [ctypes.c_long(a) if isinstance(a, int) else a for a in arguments]
    result: int = libc.syscall(ctypes.c_long(number), *given)
    return result


def _checked(result: int, what: str) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what}: {os.strerror(number)}")
    return result
