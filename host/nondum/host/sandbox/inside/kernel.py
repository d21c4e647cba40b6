"""System calls that Python has no names for. All raise `OSError`."""

from __future__ import annotations

import ctypes
import os
import signal
import struct

LIBC = ctypes.CDLL(None, use_errno=True)

PR_SET_PDEATHSIG = 1
PR_SET_DUMPABLE = 4
PR_SET_NAME = 15
PR_SET_SECCOMP = 22
PR_CAPBSET_DROP = 24
PR_SET_NO_NEW_PRIVS = 38
SECCOMP_MODE_FILTER = 2
"""From linux/prctl.h and linux/seccomp.h."""
MS_RDONLY, MS_NOSUID, MS_NODEV, MS_NOEXEC, MS_REMOUNT = 1, 2, 4, 8, 32
MS_BIND, MS_SLAVE, MS_SHARED = 1 << 12, 1 << 19, 1 << 20
MNT_DETACH = 2
"""From linux/mount.h."""
CLONE_NEWNS, CLONE_NEWUSER = 0x20000, 0x10000000
CAP_DAC_READ_SEARCH, CAP_SYS_PTRACE, CAP_SYS_ADMIN = 2, 19, 21
_CAPABILITY_VERSION_3 = 0x20080522
_LANDLOCK_RESTRICT_SELF = 446
_OPEN_TREE, _MOVE_MOUNT, _MOUNT_SETATTR = 428, 429, 442
"""The same on all architectures."""
_OPEN_TREE_CLONE, _MOVE_MOUNT_F_EMPTY_PATH = 1, 4
_AT_FDCWD, _AT_EMPTY_PATH = -100, 0x1000
_MOUNT_ATTR_NOSUID, _MOUNT_ATTR_NODEV, _MOUNT_ATTR_IDMAP = 2, 4, 0x100000
"""From linux/mount.h and linux/fcntl.h."""


def prctl(option: int, *arguments: int | ctypes.Array[ctypes.c_char]) -> int:
    """See prctl(2)."""
    given = [*arguments, 0, 0, 0, 0][:4]
    return _checked(
        LIBC.prctl(option, *(ctypes.c_ulong(a) if isinstance(a, int) else a for a in given)),
        f"prctl {option}",
    )


def text(value: str) -> ctypes.Array[ctypes.c_char]:
    """A string as `prctl` takes it."""
    return ctypes.create_string_buffer(value.encode())


def end_with(parent: int, number: signal.Signals = signal.SIGKILL) -> None:
    """Have the kernel send this process a signal once its parent ends: the thread that forked it.

    Raises `SystemExit` when the parent has ended before that could be asked for.
    """
    prctl(PR_SET_PDEATHSIG, number)
    if os.getppid() != parent:
        raise SystemExit("the host is gone")


def mount(
    source: str | None, target: str, kind: str | None, flags: int, data: str | None = None
) -> None:
    """See mount(2)."""
    texts = [os.fsencode(t) if t is not None else None for t in (source, target, kind, data)]
    result = LIBC.mount(texts[0], texts[1], texts[2], ctypes.c_ulong(flags), texts[3])
    _checked(result, f"mount {target}")


def unmount(target: str) -> None:
    """Take a mount out of sight; what is open stays so. See umount2(2)."""
    _checked(LIBC.umount2(os.fsencode(target), MNT_DETACH), f"umount {target}")


def copy_mount(folder: str) -> int:
    """A mount of a folder that is not in place yet, without those below it. See open_tree(2)."""
    flags = _OPEN_TREE_CLONE | os.O_CLOEXEC
    return _checked(
        LIBC.syscall(_OPEN_TREE, _AT_FDCWD, os.fsencode(folder), flags), f"open_tree {folder}"
    )


def map_mount(mount: int, namespace: int) -> None:
    """Have a mount that is not in place yet show files with the ids that a user namespace maps them
    to, and no set-id bits and devices. See mount_setattr(2)."""
    attributes = _MOUNT_ATTR_IDMAP | _MOUNT_ATTR_NOSUID | _MOUNT_ATTR_NODEV
    described = struct.pack("=QQQQ", attributes, 0, 0, namespace)
    size = ctypes.c_size_t(len(described))
    _checked(
        LIBC.syscall(_MOUNT_SETATTR, mount, b"", _AT_EMPTY_PATH, described, size), "mount_setattr"
    )


def place_mount(mount: int, target: str) -> None:
    """Put one into place. See move_mount(2)."""
    path, flags = os.fsencode(target), _MOVE_MOUNT_F_EMPTY_PATH
    _checked(LIBC.syscall(_MOVE_MOUNT, mount, b"", _AT_FDCWD, path, flags), f"move_mount {target}")


def unshare(flags: int) -> None:
    """See unshare(2)."""
    _checked(LIBC.unshare(flags), f"unshare {flags:#x}")


def keep_capabilities(*kept: int) -> None:
    """Give up all others, for good: the effective, permitted, inheritable and bounding sets."""
    for capability in range(64):
        if capability not in kept and LIBC.prctl(PR_CAPBSET_DROP, capability, 0, 0, 0) != 0:
            break  # the kernel has no more, or this process may not: then it holds none
    bits = sum(1 << capability for capability in kept)
    low, high = bits & 0xFFFFFFFF, bits >> 32
    header = struct.pack("=II", _CAPABILITY_VERSION_3, 0)
    data = struct.pack("=IIIIII", low, low, 0, high, high, 0)
    _checked(LIBC.capset(header, data), "capset")


def filter_calls(program: bytes) -> None:
    """Have the kernel refuse what a program of `struct sock_filter` says. See seccomp(2)."""
    code = ctypes.create_string_buffer(program, len(program))
    length, address = len(program) // 8, ctypes.addressof(code)
    described = struct.pack("@HP", length, address)
    prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.create_string_buffer(described))


def restrict_to(ruleset: int) -> None:
    """Take on a ruleset of Landlock, by descriptor. See landlock_restrict_self(2)."""
    _checked(LIBC.syscall(_LANDLOCK_RESTRICT_SELF, ruleset, 0), "landlock_restrict_self")


def _checked(result: int, what: str) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what}: {os.strerror(number)}")
    return result
