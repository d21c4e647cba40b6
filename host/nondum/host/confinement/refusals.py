"""Which system calls workers are refused, in groups, and why.

The groups of Flatpak (common/flatpak-run.c, `setup_seccomp`) and what else has no place in a
plugin: what changes the system or its clock, what other programs' memory can be read with, and
interfaces that are known rather for the holes in them.
"""

from __future__ import annotations

import errno
import platform
from collections.abc import Collection, Mapping

from nondum.host.confinement.filters import Rule, encoded, program
from nondum.host.confinement.system_calls import ARCHITECTURES

_NEW_NAMESPACES = 0x7E020000
"""CLONE_NEWNS, NEWCGROUP, NEWUTS, NEWIPC, NEWUSER, NEWPID and NEWNET (linux/sched.h)."""
_TIOCSTI, _TIOCLINUX = 0x5412, 0x541C
_AF_UNIX, _AF_INET, _AF_NETLINK, _AF_INET6 = 1, 2, 16, 10


def _all(*calls: str, error: int = errno.EPERM) -> tuple[Rule, ...]:
    return tuple(Rule(call, error) for call in calls)


def _sockets(*families: int) -> tuple[Rule, ...]:
    return (Rule("socket", errno.EAFNOSUPPORT, argument=0, other_than=families),)


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
    # Rather exotic ones have more holes, and some (vsock) know nothing of network namespaces.
    "sockets": _sockets(_AF_UNIX, _AF_INET, _AF_INET6, _AF_NETLINK),
}
"""What every worker is refused, but at level `none`."""

WITHOUT_NAMESPACES: Mapping[str, tuple[Rule, ...]] = {
    "messages": _all("shmget", "shmat", "shmctl", "semget", "msgget", "mq_open"),
}
"""What workers are refused beside where they share the host's namespaces."""

SOCKETS_OF_THE_HOST: Mapping[bool, tuple[Rule, ...]] = {
    False: _sockets(-1 & 0xFFFFFFFF),
    True: _sockets(_AF_INET, _AF_INET6, _AF_NETLINK),
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


def filter_of(
    groups: Mapping[str, tuple[Rule, ...]], architecture: str, *, without: Collection[str] = ()
) -> bytes:
    """The filter that refuses all groups but some. Raises `KeyError` for an unknown machine."""
    rules = [rule for name, group in groups.items() if name not in without for rule in group]
    return encoded(program(rules, ARCHITECTURES[architecture]))
