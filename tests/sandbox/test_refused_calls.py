"""Which system calls workers are refused, row by row: none leaves the tables unseen."""

from __future__ import annotations

import errno

import pytest

from nondum.host.sandbox.levels.filters import Rule
from nondum.host.sandbox.levels.refusals import (
    GROUPS,
    SOCKETS_OF_THE_HOST,
    TRUNCATION,
    WITH_THE_HOSTS_USER,
    WITHOUT_NAMESPACES,
)

ALWAYS = {
    "mounts": (
        *("mount", "umount2", "pivot_root", "chroot", "swapon", "swapoff", "mount_setattr"),
        *("open_tree", "open_tree_attr", "move_mount", "fsopen", "fsconfig", "fsmount", "fspick"),
    ),
    "namespaces": ("unshare", "setns", "clone3"),
    "spying": (
        *("ptrace", "process_vm_readv", "process_vm_writev", "kcmp", "pidfd_getfd"),
        *("process_madvise", "process_mrelease", "migrate_pages", "move_pages"),
    ),
    "keys": ("add_key", "request_key", "keyctl"),
    "bpf": ("bpf",),
    "perf": ("perf_event_open",),
    "userfaultfd": ("userfaultfd",),
    "io_uring": ("io_uring_setup", "io_uring_enter", "io_uring_register"),
    "handles": ("open_by_handle_at", "name_to_handle_at", "fanotify_init", "lookup_dcookie"),
    "kernel": (
        *("init_module", "finit_module", "delete_module", "kexec_load", "kexec_file_load"),
        *("reboot", "syslog", "acct", "quotactl", "quotactl_fd", "uselib", "iopl", "ioperm"),
        *("settimeofday", "clock_settime", "clock_adjtime", "adjtimex"),
        *("sethostname", "setdomainname", "modify_ldt"),
    ),
    "messages": ("shmget", "shmat", "shmctl", "semget", "msgget", "mq_open"),
}
"""Group → calls that are refused whatever their arguments are."""
MISSING = {"clone3", "io_uring_setup", "io_uring_enter", "io_uring_register"}
"""Those that seem not to be there, so that the C library does without."""

NEW = 0x7E020000
SOMETIMES = {
    ("namespaces", "clone", 0): {
        0x11: False,
        **{1 << bit: True for bit in range(32) if NEW >> bit & 1},
    },
    ("spying", "prlimit64", 0): {0: False, 1: True},
    ("kernel", "personality", 0): {0: False, 0xFFFFFFFF: False, 0x20000: True},
    ("terminal", "ioctl", 1): {0x5401: False, 0x5412: True, 0x541C: True},
    ("sockets", "socket", 0): {1: False, 2: False, 10: False, 16: False, 17: True, 40: True},
}
"""Group, call, which argument decides → its value, and whether the call is refused then."""

WITH_ERRORS = {
    ("metadata", 0): ("chmod", "fchmod", "fchmodat", "utime", "utimes", "futimesat", "utimensat"),
    ("metadata", errno.EPERM): (
        *("chown", "fchown", "lchown", "fchownat", "file_setattr"),
        *("removexattr", "lremovexattr", "fremovexattr", "removexattrat"),
    ),
    ("metadata", errno.EOPNOTSUPP): ("setxattr", "lsetxattr", "fsetxattr", "setxattrat"),
    ("truncation", errno.EPERM): ("truncate",),
}
"""Group, and what its calls fail with (0: they do nothing) → those that always do."""

GROUPS_OF_ALL = {**GROUPS, **WITHOUT_NAMESPACES}
WITH_ITS_USER = {**WITH_THE_HOSTS_USER, **TRUNCATION}


@pytest.mark.parametrize(("group", "call"), [(g, c) for g, calls in ALWAYS.items() for c in calls])
def test_call_is_refused_whatever_it_is_asked(group: str, call: str) -> None:
    wanted = errno.ENOSYS if call in MISSING else errno.EPERM
    rules = [rule for rule in GROUPS_OF_ALL[group] if rule.call == call]
    assert [(rule.is_always, rule.error) for rule in rules] == [(True, wanted)]


@pytest.mark.parametrize(("group", "call", "argument"), SOMETIMES)
def test_call_is_refused_for_what_its_argument_says(group: str, call: str, argument: int) -> None:
    rules = [r for r in GROUPS_OF_ALL[group] if (r.call, r.argument) == (call, argument)]
    values = SOMETIMES[group, call, argument]
    assert {value: any(is_refused(rule, value) for rule in rules) for value in values} == values


@pytest.mark.parametrize(
    ("group", "error", "call"),
    [(*key, call) for key, calls in WITH_ERRORS.items() for call in calls],
)
def test_call_is_refused_where_the_user_is_the_hosts(group: str, error: int, call: str) -> None:
    rules = [rule for rule in WITH_ITS_USER[group] if rule.call == call and rule.is_always]
    assert [rule.error for rule in rules] == [error]


def is_refused(rule: Rule, value: int) -> bool:
    if rule.other_than:
        return value not in rule.other_than
    return value in rule.equal or bool(value & rule.any_bit)


@pytest.mark.parametrize(("is_allowed", "families"), [(False, set()), (True, {2, 10, 16})])
def test_sockets_of_the_host_are_of_the_network_only(is_allowed: bool, families: set[int]) -> None:
    """Where workers share its network, and only if they may use it."""
    rules = [rule for rule in SOCKETS_OF_THE_HOST[is_allowed] if rule.call == "socket"]
    assert rules
    found = {f for f in range(64) if not any(is_refused(rule, f) for rule in rules)}
    assert found == families
