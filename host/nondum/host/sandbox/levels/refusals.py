"""Which system calls workers are refused, in groups, and why.

The groups of Flatpak (common/flatpak-run.c, `setup_seccomp`) and what else has no place in a
plugin: what changes the system or its clock, what other programs' memory can be read with, and
interfaces that are known rather for the holes in them.
"""

from __future__ import annotations

import errno
import os
import platform
import stat
from collections.abc import Collection, Mapping
from pathlib import Path

from nondum.host.sandbox.levels.filters import Rule, encoded, program
from nondum.host.sandbox.levels.system_calls import ARCHITECTURES

_NEW_NAMESPACES = 0x7E020000
"""CLONE_NEWNS, NEWCGROUP, NEWUTS, NEWIPC, NEWUSER, NEWPID and NEWNET (linux/sched.h)."""
_TIOCSTI, _TIOCLINUX = 0x5412, 0x541C
_AF_UNIX, _AF_INET, _AF_NETLINK, _AF_INET6 = 1, 2, 16, 10
_TYPE, _SOCK_DGRAM, _SOCK_RAW = 0xF, 2, 3
"""Of sockets (linux/net.h); raw ones of the kind `AF_UNIX` are datagram sockets."""
_SET_ID = stat.S_ISUID | stat.S_ISGID
_FILE_TYPE, _DEVICES = 0o170000, (stat.S_IFCHR, stat.S_IFBLK)
_MAKES_A_FILE = os.O_CREAT | 0o20000000
"""Flags of open(2) with which its mode counts: O_CREAT, and what O_TMPFILE is beside a folder."""
_PRIO, _IOPRIO = (0, 1), (1, 2)
"""What setpriority(2) and ioprio_set(2) call a process and a process group; a user is the third."""


def _all(*calls: str, error: int = errno.EPERM) -> tuple[Rule, ...]:
    return tuple(Rule(call, error) for call in calls)


def _sockets(*families: int) -> tuple[Rule, ...]:
    return (
        Rule("socket", errno.EAFNOSUPPORT, argument=0, other_than=families),
        Rule("socketpair", errno.EAFNOSUPPORT, argument=0, other_than=(_AF_UNIX,)),
    )


def _sockets_of_the_host(*families: int) -> tuple[Rule, ...]:
    """With sockets that have a name within reach: a datagram can be sent to any from a pair's end,
    which those of other kinds refuse."""
    pairs = Rule("socketpair", errno.EAFNOSUPPORT, 1, _TYPE, equal=(_SOCK_DGRAM, _SOCK_RAW))
    return (*_sockets(*families), pairs)


GROUPS: Mapping[str, tuple[Rule, ...]] = {
    "mounts": _all(
        *("mount", "umount2", "pivot_root", "chroot", "swapon", "swapoff", "mount_setattr"),
        *("open_tree", "open_tree_attr", "move_mount", "fsopen", "fsconfig", "fsmount", "fspick"),
    ),
    "namespaces": (
        *_all("unshare", "setns"),
        Rule("clone", errno.EPERM, argument=0, any_bit=_NEW_NAMESPACES),
        # Its flags are in memory, where filters cannot look: the C library falls back to clone.
        *_all("clone3", error=errno.ENOSYS),
    ),
    "spying": (
        *_all("ptrace", "process_vm_readv", "process_vm_writev", "kcmp", "pidfd_getfd"),
        *_all("process_madvise", "process_mrelease", "migrate_pages", "move_pages"),
        Rule("prlimit64", errno.EPERM, argument=0, other_than=(0,)),
    ),
    "keys": _all("add_key", "request_key", "keyctl"),
    "bpf": _all("bpf"),
    "perf": _all("perf_event_open"),
    "userfaultfd": _all("userfaultfd"),
    "io_uring": _all("io_uring_setup", "io_uring_enter", "io_uring_register", error=errno.ENOSYS),
    "handles": _all("open_by_handle_at", "name_to_handle_at", "fanotify_init", "lookup_dcookie"),
    "kernel": (
        *_all("init_module", "finit_module", "delete_module", "kexec_load", "kexec_file_load"),
        *_all("reboot", "syslog", "acct", "quotactl", "quotactl_fd", "uselib", "iopl", "ioperm"),
        *_all("settimeofday", "clock_settime", "clock_adjtime", "adjtimex"),
        *_all("sethostname", "setdomainname", "modify_ldt"),
        Rule("personality", errno.EPERM, argument=0, other_than=(0, 0xFFFFFFFF)),
    ),
    "terminal": (
        # What is written so is read as if it had been typed (CVE-2017-5226, CVE-2023-1523).
        Rule("ioctl", errno.EPERM, argument=1, equal=(_TIOCSTI, _TIOCLINUX)),
    ),
    # What outlives its worker on the host's disk, for other users to run or open. Upper bits of a
    # mode are not looked at (umode_t has 16), nor are these bits when a folder is made (mkdir(2)).
    "special files": (
        *(Rule(call, errno.EPERM, 1, any_bit=_SET_ID) for call in ("chmod", "fchmod", "mknod")),
        *(Rule(call, errno.EPERM, 2, any_bit=_SET_ID) for call in ("fchmodat", "mknodat")),
        Rule("creat", errno.EPERM, 1, any_bit=_SET_ID),
        Rule("open", errno.EPERM, 2, any_bit=_SET_ID, only_with=(1, _MAKES_A_FILE)),
        Rule("openat", errno.EPERM, 3, any_bit=_SET_ID, only_with=(2, _MAKES_A_FILE)),
        Rule("mknod", errno.EPERM, 1, _FILE_TYPE, equal=_DEVICES),
        Rule("mknodat", errno.EPERM, 2, _FILE_TYPE, equal=_DEVICES),
        # Their modes are in memory or come with flags: the C library falls back to the older ones.
        *_all("openat2", "fchmodat2", error=errno.ENOSYS),
    ),
    # Rather exotic ones have more holes, and some (vsock) know nothing of network namespaces.
    "sockets": _sockets(_AF_UNIX, _AF_INET, _AF_INET6, _AF_NETLINK),
}
"""What every worker is refused, but at level `none`."""

AT_LEAST = {name: rules for name, rules in GROUPS.items() if name == "special files"}
"""What it is refused at level `none`, too."""

WITHOUT_NAMESPACES: Mapping[str, tuple[Rule, ...]] = {
    "messages": _all("shmget", "shmat", "shmctl", "semget", "msgget", "mq_open"),
    # Opened neither to read nor to write (open(2), access mode 3): Landlock is not asked then.
    "bare opens": (
        Rule("open", errno.EINVAL, 1, os.O_ACCMODE, equal=(os.O_ACCMODE,)),
        Rule("openat", errno.EINVAL, 2, os.O_ACCMODE, equal=(os.O_ACCMODE,)),
    ),
}
"""What workers are refused beside where they share the host's namespaces."""

WITH_THE_HOSTS_USER: Mapping[str, tuple[Rule, ...]] = {
    # Landlock does not see these. What plain programs call on each file that they copy does
    # nothing, and says that it was done; the rest fails.
    "metadata": (
        *_all("chmod", "fchmod", "fchmodat", error=0),
        # Of a path, and without times: `Path.touch` makes the file if that fails, and else not.
        Rule("utimensat", errno.EPERM, argument=2, equal=(0,), only_with=(1, 0xFFFFFFFF)),
        *_all("utime", "utimes", "futimesat", "utimensat", error=0),
        *_all("chown", "fchown", "lchown", "fchownat", "file_setattr"),
        *_all("setxattr", "lsetxattr", "fsetxattr", "setxattrat", error=errno.EOPNOTSUPP),
        *_all("removexattr", "lremovexattr", "fremovexattr", "removexattrat"),
    ),
    # Filters do not know the worker's own id: 0 stands for it.
    "scheduling": (
        *(
            Rule(f"sched_set{what}", errno.EPERM, argument=0, other_than=(0,))
            for what in ("scheduler", "param", "attr", "affinity")
        ),
        Rule("setpriority", errno.EPERM, argument=0, other_than=_PRIO),
        Rule("setpriority", errno.EPERM, argument=1, other_than=(0,)),
        Rule("ioprio_set", errno.EPERM, argument=0, other_than=_IOPRIO),
        Rule("ioprio_set", errno.EPERM, argument=1, other_than=(0,)),
    ),
}
"""What workers are refused beside where files and processes of the host belong to their user."""

TRUNCATION: Mapping[str, tuple[Rule, ...]] = {
    "truncation": (
        *_all("truncate"),
        Rule("open", errno.EPERM, 1, os.O_ACCMODE | os.O_TRUNC, equal=(os.O_TRUNC,)),
        Rule("openat", errno.EPERM, 2, os.O_ACCMODE | os.O_TRUNC, equal=(os.O_TRUNC,)),
    ),
}
"""The same where Landlock does not know the right to truncate (ABI 1 and 2): by path, and by
opening a file that may only be read. Files that may be written may be truncated."""

SOCKETS_OF_THE_HOST: Mapping[bool, tuple[Rule, ...]] = {
    False: _sockets_of_the_host(-1 & 0xFFFFFFFF),
    True: _sockets_of_the_host(_AF_INET, _AF_INET6, _AF_NETLINK),
}
"""The group `sockets` where workers share the host's network: by whether they may use it.

Sockets of other processes are reached by a name or a path, which filters cannot look at, so none of
the kind `AF_UNIX` is to be had; pairs of them are (socketpair(2)).
"""


def machine() -> str:
    """This machine's architecture."""
    return platform.machine()


def is_known(architecture: str) -> bool:
    """Whether system calls can be filtered on an architecture."""
    return architecture in ARCHITECTURES


def has_filters() -> bool:
    """Whether this kernel can filter system calls (seccomp(2), /proc interfaces)."""
    return Path("/proc/sys/kernel/seccomp/actions_avail").exists()


def filter_of(
    groups: Mapping[str, tuple[Rule, ...]], architecture: str, *, without: Collection[str] = ()
) -> bytes:
    """The filter that refuses all groups but some. Raises `KeyError` for an unknown machine."""
    rules = [rule for name, group in groups.items() if name not in without for rule in group]
    return encoded(program(rules, ARCHITECTURES[architecture]))
