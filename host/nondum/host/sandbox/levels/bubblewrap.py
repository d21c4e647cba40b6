"""The sandbox of a worker: how bubblewrap is called for an interpreter that waits.

Source: bwrap(1). What only the worker needs is mounted once the worker is known (see
`nondum.host.sandbox.inside.mounts`); until then the interpreter, which runs nothing but the host's
own code, holds capabilities in a separate user namespace.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Collection, Iterator, Mapping
from dataclasses import field
from pathlib import Path

from nondum.host.sandbox.helper.client import DEVICES
from nondum.host.sandbox.levels.users import NewNamespace
from nondum.sdk.frozen import frozen

OUTSIDE = "/.host"
"""Where the host's folders are seen, until the worker leaves init's mount namespace."""
INSIDE = Path(__file__).parents[1] / "inside"
PLACE_OF_INSIDE = Path("/run/nondum/host/nondum/host/sandbox/inside")
BOOTSTRAP = PLACE_OF_INSIDE / "bootstrap.py"
NODES = tuple(f"/dev/{name}" for name in ("null", "zero", "full", "random", "urandom", "tty"))
"""Nodes of the host that bubblewrap brings into every sandbox."""
TEMPORARY_BYTES = 64 * 1024 * 1024
"""Size of /tmp."""

NAMESPACES: Mapping[str, tuple[str, ...]] = {
    "processes": ("--unshare-pid", "--as-pid-1"),
    "messages": ("--unshare-ipc",),
    "host name": ("--unshare-uts", "--hostname", "worker"),
    "network": ("--unshare-net",),
    "cgroups": ("--unshare-cgroup-try",),
}
"""Namespaces that bubblewrap makes, and their flags; each can be left out.

Not `--die-with-parent`: a daemon that died while bubblewrap makes a user namespace would have it
killed before it lets the process in the namespace go on, which would wait for ever. A process in
the sandbox sees the daemon's end by its socket, see `nondum.host.sandbox.inside`."""
SEALED: tuple[str, ...] = (
    *("/proc/sys", "/proc/sysrq-trigger", "/proc/irq", "/proc/bus", "/proc/fs", "/proc/acpi"),
)
"""What root may write by being root, capabilities or not, is read only: `core_pattern` runs
programs."""
PROTECTED: tuple[str, ...] = ("/", "/dev", "/dev/nondum")
"""Mounts that become read-only once the sandbox is set up (`nondum.host.sandbox.inside.mounts`)."""

_SYSTEM = ("/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64")
_SETTINGS = (
    *("/etc/ld.so.cache", "/etc/ld.so.conf", "/etc/ld.so.conf.d", "/etc/alternatives"),
    *("/etc/localtime", "/etc/fonts", "/etc/mime.types"),
)
"""What libraries look for, and says nothing of the host."""
_OF_THE_NETWORK = (
    *("/etc/resolv.conf", "/etc/nsswitch.conf", "/etc/hosts", "/etc/host.conf", "/etc/gai.conf"),
    *("/etc/services", "/etc/protocols", "/etc/ssl", "/etc/ca-certificates", "/etc/pki"),
)
_OF_THE_GPU = ("/sys", "/etc/OpenCL", "/etc/vulkan", "/etc/glvnd", "/etc/nvidia")


def places_of_nodes() -> tuple[str, ...]:
    """Where device nodes are: the machine's, and, for one who is not root, the helper's."""
    return ("/dev", *([str(DEVICES)] if os.geteuid() != 0 and DEVICES.is_dir() else ()))


@frozen
class Ground:
    """What an interpreter is started with; a worker that needs no other may be made of it."""

    python: Path
    seen: tuple[Path, ...]
    """Folders of the host from which code and scratch come."""
    permissions: frozenset[str] = frozenset()
    """Of those that were granted, the ones that change the ground."""
    nodes: tuple[str, ...] = field(default_factory=places_of_nodes)
    """Folders of devices, as far as they are there by now."""

    def carries(self, python: Path, folders: Collection[Path], permissions: frozenset[str]) -> bool:
        """Whether a worker of this interpreter, these folders and permissions may stand on it."""
        return (
            self.python == python
            and self.permissions == permissions
            and all(any(f.is_relative_to(root) for root in self.seen) for f in folders)
        )


def program() -> str | None:
    """Where bubblewrap is; None where it is not installed."""
    return shutil.which("bwrap")


def command(
    bwrap: str,
    ground: Ground,
    orders: int,
    namespace: NewNamespace | None = None,
    *,
    without: Collection[str] = (),
) -> list[str]:
    """How an interpreter is started on a ground; `orders` is the descriptor that it hears at.

    The users of `namespace` are mapped by the caller; without one there is only the caller's.
    `without` leaves names of `NAMESPACES` out, so that tests can show that each matters.
    """
    return [
        bwrap,
        *(namespace.flags if namespace is not None else ()),
        *("--unshare-user", "--uid", "0", "--gid", "0", "--cap-add", "ALL"),
        *_namespaces(ground.permissions, without),
        *("--proc", "/proc", "--dev", "/dev"),
        *_temporary(without),
        *_system(ground.permissions),
        *_interpreter(),
        *("--ro-bind", str(INSIDE), str(PLACE_OF_INSIDE)),
        *(part for folder in ground.seen for part in ("--bind", str(folder), f"{OUTSIDE}{folder}")),
        *(part for at in ground.nodes for part in ("--dev-bind", at, f"{OUTSIDE}{at}")),
        *("--chdir", "/", "--"),
        *(str(ground.python), "-I", "-S", "-B", "-u", str(BOOTSTRAP), str(orders)),
        "0",
    ]


def seen_outside(ground: Ground) -> list[str]:
    """The host's folders that are seen below `OUTSIDE`."""
    return [*map(str, ground.seen), *ground.nodes]


def _namespaces(permissions: Collection[str], without: Collection[str]) -> Iterator[str]:
    for name, flags in NAMESPACES.items():
        if name not in without and not (name == "network" and "network" in permissions):
            yield from flags


def _temporary(without: Collection[str]) -> Iterator[str]:
    if "size of tmp" not in without:
        yield from ("--size", str(TEMPORARY_BYTES))
    yield from ("--tmpfs", "/tmp")


def _system(permissions: Collection[str]) -> Iterator[str]:
    for name in _SYSTEM:
        path = Path(name)
        if path.is_symlink():
            yield from ("--symlink", os.readlink(path), name)  # noqa: PTH115
        elif path.is_dir():
            yield from ("--ro-bind", name, name)
    for name in _settings(permissions):
        yield from ("--ro-bind-try", name, name)


def _settings(permissions: Collection[str]) -> Iterator[str]:
    yield from _SETTINGS
    yield from _OF_THE_NETWORK if "network" in permissions else ()
    yield from _OF_THE_GPU if "gpu" in permissions else ()


def prefixes() -> tuple[Path, ...]:
    """Where the base interpreter's own files are, if not with the system's."""
    found = sorted({Path(p).resolve() for p in (sys.base_prefix, sys.base_exec_prefix)})
    return tuple(p for p in found if not any(p.is_relative_to(name) for name in _SYSTEM))


def _interpreter() -> Iterator[str]:
    for prefix in prefixes():
        yield from ("--ro-bind", str(prefix), str(prefix))
