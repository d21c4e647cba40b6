"""The mounts of a sandbox: what the worker sees in it, and what is unmounted.

Bubblewrap has made the namespaces and the first mounts. Two mount namespaces follow: that of *init*
(process 1), which still sees the devices of the machine so that one can be mounted while the worker
runs, and the worker's own, a copy of it in which everything outside is unmounted. What is mounted
below `/dev/nondum` in the first appears in the second (mount_namespaces(7), propagation).
"""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from nondum.host.sandbox.inside import kernel

DEVICES = "/dev/nondum"
OVERFLOW_ID = 65534
"""The worker's user and group in its own user namespace (/proc/sys/kernel/overflowuid)."""
INOTIFY_INSTANCES = 16
"""Of one worker. Those of all sandboxes count for the user of the host, who has 128 of them."""
_STAGED = "/run/nondum/staged"
"""Where a device is mounted before it appears: later changes of flags are not propagated."""
_BOUND = kernel.MS_BIND | kernel.MS_REMOUNT


def set_up(given: Mapping[str, Any], map_mount: Callable[[int], None]) -> None:
    """Mount what the worker may see. Raises `OSError`.

    `outside`: where the host's folders are seen. `code`: folders to read. `scratch`: the folder to
    write; if the host `maps_scratch`, what is in it is the worker's there, and the host's on disk:
    `map_mount` has a mount be so before it is in place. `nodes`: devices, as paths on the host,
    under their own names.
    `shared_mb`: size of /dev/shm. `is_last`: whether user namespaces end here.
    """
    outside = given["outside"]
    for folder in given["code"]:
        bind(outside + folder, folder, kernel.MS_RDONLY if given["protects_code"] else 0)
    if given["maps_scratch"]:
        _bind_mapped(outside + given["scratch"], given["scratch"], map_mount)
    else:
        bind(outside + given["scratch"], given["scratch"], 0)
    _mount_memory("/dev/shm", given["shared_mb"] * 1024, "1777")  # of this namespace only
    Path("/tmp").chmod(0o1777)
    _mount_memory(DEVICES, 64, "755")
    kernel.mount(None, DEVICES, None, kernel.MS_SHARED)
    for node in given["nodes"]:
        with contextlib.suppress(FileNotFoundError):  # not every machine has it
            _bind_node(outside + node, node)
    _write_users(given["scratch"])
    _let_pass(outside)
    if given["is_last"]:  # the worker's own, below, is the only one there will ever be
        Path("/proc/sys/user/max_user_namespaces").write_text("1")
    with contextlib.suppress(FileNotFoundError):  # a kernel without inotify
        Path("/proc/sys/user/max_inotify_instances").write_text(str(given["inotify_instances"]))


def pivot(given: Mapping[str, Any]) -> None:
    """Enter the worker's mount and user namespaces, in which it owns nothing of init's.

    `sealed`: what may be read only, though its user might write it; `protected`: mounts likewise.
    `user`: one that is this worker's alone, also to the kernel, or null; `groups` that it has
    beside, or null: those of the host. Raises `OSError`.
    """
    kernel.unshare(kernel.CLONE_NEWNS)
    kernel.mount(None, DEVICES, None, kernel.MS_SLAVE)
    if given["hides_outside"]:
        for folder in reversed(given["seen_outside"]):
            kernel.unmount(given["outside"] + folder)
    for folder in given["sealed"]:
        with contextlib.suppress(FileNotFoundError):
            kernel.mount(folder, folder, None, kernel.MS_BIND)
            kernel.mount(None, folder, None, _BOUND | kernel.MS_RDONLY | _flags_of(folder))
    for folder in given["protected"]:
        kernel.mount(None, folder, None, _BOUND | kernel.MS_RDONLY | _flags_of(folder))
    if given["user"] is not None:
        _become(given["user"], given["groups"])
    user, group = os.geteuid(), os.getegid()
    if given["changes_user"]:
        kernel.unshare(kernel.CLONE_NEWUSER)
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"{OVERFLOW_ID} {user} 1")
        Path("/proc/self/gid_map").write_text(f"{OVERFLOW_ID} {group} 1")


def _become(user: int, groups: Sequence[int] | None) -> None:
    """Be another user from now on, for all that the kernel counts and asks."""
    for output in (1, 2):  # which may be opened by name: /dev/stderr
        os.fchown(output, user, user)
    if groups is not None:
        os.setgroups(groups)
    os.setresgid(user, user, user)
    os.setresuid(user, user, user)
    kernel.prctl(kernel.PR_SET_DUMPABLE, 1)  # else what is its own in /proc is root's


def grant(outside: str, need: str, node: str, own: str) -> None:
    """Make a device of the host appear below `DEVICES`, and link to it from where it is there:
    libraries look for sound cards at one place only. Raises `OSError`."""
    revoke(need)
    if os.path.isdir(outside + node):  # noqa: PTH112
        raise OSError(f"{node} is no device")
    target = f"{DEVICES}/{need}"
    _bind_node(outside + node, target)
    if own.startswith("/dev/") and not own.startswith(f"{DEVICES}/"):
        with contextlib.suppress(OSError):  # it is in the sandbox anyway: /dev/zero, /dev/snd
            os.makedirs(os.path.dirname(own), exist_ok=True)  # noqa: PTH103, PTH120
            os.symlink(target, own)  # noqa: PTH211
            _links[need] = own


def revoke(need: str) -> None:
    """Make it vanish; descriptors of it live on, which the plugin is told otherwise."""
    target = f"{DEVICES}/{need}"
    with contextlib.suppress(OSError):
        kernel.unmount(target)
    for path in (target, _links.pop(need, target)):
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)  # noqa: PTH108  # no class for each of a few plain calls


_links: dict[str, str] = {}
"""In process 1 of the sandbox: need → where a link to its node is."""


def bind(source: str, target: str, more: int = 0) -> None:
    """Have a folder seen in another place, without devices and set-id bits, whatever was before.

    Bubblewrap's own mounts leave them out, too. Raises `OSError`.
    """
    os.makedirs(target, exist_ok=True)  # noqa: PTH103
    kernel.mount(source, target, None, kernel.MS_BIND)
    flags = _flags_of(target) | kernel.MS_NOSUID | kernel.MS_NODEV | more
    kernel.mount(None, target, None, _BOUND | flags)


def _bind_mapped(source: str, target: str, map_mount: Callable[[int], None]) -> None:
    """The same, with the users that files have there mapped, and the flags set, by who may."""
    os.makedirs(target, exist_ok=True)  # noqa: PTH103
    mount = kernel.copy_mount(source)
    try:
        map_mount(mount)
        kernel.place_mount(mount, target)
    finally:
        os.close(mount)


def _bind_node(source: str, target: str) -> None:
    """A device, or a folder of devices, and nothing else.

    It can be written to, and its node stays as it is: the node's owner, who may be the worker's
    user, could close it to everybody else on the host. Raises `OSError`.
    """
    mode = os.stat(source).st_mode  # noqa: PTH116
    is_folder = stat.S_ISDIR(mode)
    if not (is_folder or stat.S_ISCHR(mode) or stat.S_ISBLK(mode)):
        raise OSError(f"{source} is no device")
    staged = f"{_STAGED}/{'folder' if is_folder else 'node'}"
    for place in (staged, target):
        os.makedirs(place if is_folder else os.path.dirname(place), exist_ok=True)  # noqa: PTH103, PTH120
        if not is_folder:
            os.close(os.open(place, os.O_CREAT | os.O_CLOEXEC, 0o600))
    kernel.mount(source, staged, None, kernel.MS_BIND)
    try:
        kernel.mount(None, staged, None, _BOUND | kernel.MS_RDONLY | _flags_of(staged))
        kernel.mount(staged, target, None, kernel.MS_BIND)
    finally:
        kernel.unmount(staged)


def _let_pass(outside: str) -> None:
    """Let every user pass through the folders that bubblewrap made, except those below `outside`:
    it makes some for root only."""
    own = Path("/").stat().st_dev
    folders = ["/"]
    while folders:
        with os.scandir(folders.pop()) as entries:
            for entry in entries:
                is_own = entry.stat(follow_symlinks=False).st_dev == own
                if is_own and entry.is_dir(follow_symlinks=False) and entry.path != outside:
                    Path(entry).chmod(0o755)
                    folders.append(entry.path)


def _mount_memory(target: str, kilobytes: int, mode: str) -> None:
    os.makedirs(target, exist_ok=True)  # noqa: PTH103
    flags = kernel.MS_NOSUID | kernel.MS_NODEV | kernel.MS_NOEXEC
    kernel.mount("tmpfs", target, "tmpfs", flags, ",".join((f"size={kilobytes}k", f"mode={mode}")))


def _flags_of(target: str) -> int:
    """Flags of a mount that a remount must repeat: some may not be taken back (mount(2))."""
    flags = os.statvfs(target).f_flag
    return flags & (kernel.MS_RDONLY | kernel.MS_NOSUID | kernel.MS_NODEV | kernel.MS_NOEXEC)


def _write_users(home: str) -> None:
    """Who the worker is, for programs that ask by number (getpwuid(3))."""
    os.makedirs("/etc", exist_ok=True)  # noqa: PTH103
    ids = f"{OVERFLOW_ID}:{OVERFLOW_ID}"
    Path("/etc/passwd").write_text(f"worker:x:{ids}::{home}:/usr/sbin/nologin\n")
    Path("/etc/group").write_text(f"worker:x:{OVERFLOW_ID}:\n")
