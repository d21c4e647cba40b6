"""The filter of system calls: a program for the kernel, run here by a separate interpreter."""

from __future__ import annotations

import errno
import os
import stat
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.sandbox.levels.filters import ALLOW, ERROR, KILL, Rule, encoded, program
from nondum.host.sandbox.levels.refusals import (
    GROUPS,
    SOCKETS_OF_THE_HOST,
    TRUNCATION,
    WITH_THE_HOSTS_USER,
    WITHOUT_NAMESPACES,
    filter_of,
)
from nondum.host.sandbox.levels.system_calls import ARCHITECTURES, Architecture

X86, ARM = ARCHITECTURES["x86_64"], ARCHITECTURES["aarch64"]
EVERY = {**GROUPS, **WITHOUT_NAMESPACES, **WITH_THE_HOSTS_USER, **TRUNCATION}
ALL = tuple(rule for group in EVERY.values() for rule in group)
WORDS = st.integers(0, 2**32 - 1)


def run(code: bytes, number: int, audit: int, *arguments: int) -> int:
    """What the kernel would do with a call (seccomp(2), bpf(4))."""
    given = [*arguments, 0, 0, 0, 0, 0, 0][:6]
    data = struct.pack("<iIQ6Q", number - (number >> 31 << 32), audit, 0, *given)
    instructions = list(struct.iter_unpack("=HBBI", code))
    at = accumulator = 0
    while True:
        operation, if_true, if_false, value = instructions[at]
        at += 1
        if operation == 0x06:
            return int(value)
        if operation == 0x20:
            accumulator = struct.unpack_from("<I", data, value)[0]
            continue
        if operation == 0x54:
            accumulator &= value
            continue
        holds = {
            0x15: accumulator == value,
            0x35: accumulator >= value,
            0x45: bool(accumulator & value),
        }[operation]
        at += if_true if holds else if_false


def refused(rule: Rule, arguments: list[int]) -> bool:
    if rule.is_always:
        return True
    if rule.only_with is not None and not arguments[rule.only_with[0]] & rule.only_with[1]:
        return False
    argument = arguments[rule.argument] & rule.mask
    if rule.other_than:
        return argument not in rule.other_than
    return argument in rule.equal or bool(argument & rule.any_bit)


@pytest.mark.parametrize("architecture", [X86, ARM], ids=["x86_64", "aarch64"])
@given(number=st.integers(0, 500), arguments=st.lists(WORDS, min_size=6, max_size=6))
def test_filter_says_what_its_rules_say(
    architecture: Architecture, number: int, arguments: list[int]
) -> None:
    code = encoded(program(ALL, architecture))
    rules = [r for r in ALL if architecture.numbers.get(r.call) == number]
    wanted = next((ERROR | r.error for r in rules if refused(r, arguments)), ALLOW)
    assert run(code, number, architecture.audit, *arguments) == wanted


@given(number=WORDS)
def test_calls_of_other_machines_end_the_process(number: int) -> None:
    code = encoded(program(ALL, X86))
    assert run(code, number, ARM.audit) == KILL
    assert run(code, number | 0x40000000, X86.audit) == KILL


@pytest.mark.parametrize(
    ("call", "argument", "value", "is_refused"),
    [
        pytest.param("clone", 0, 0x11, False, id="fork"),
        pytest.param("clone", 0, 0x3D0F00, False, id="a thread"),
        pytest.param("clone", 0, 0x10000011, True, id="a user namespace"),
        pytest.param("ioctl", 1, 0x5401, False, id="asks a terminal"),
        pytest.param("ioctl", 1, 0x5412, True, id="types into a terminal"),
        pytest.param("ioctl", 1, 0x1_0000_5412, True, id="so, with bits that the kernel ignores"),
        pytest.param("socket", 0, 2, False, id="internet"),
        pytest.param("socket", 0, 40, True, id="vsock"),
        pytest.param("personality", 0, 0xFFFFFFFF, False, id="asks its personality"),
        pytest.param("prlimit64", 0, 0, False, id="its own limits"),
        pytest.param("prlimit64", 0, 1, True, id="those of others"),
    ],
)
@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
def test_arguments_decide(
    machine: str, call: str, argument: int, value: int, is_refused: bool
) -> None:
    architecture = ARCHITECTURES[machine]
    arguments = [0] * 6
    arguments[argument] = value
    said = run(
        filter_of(GROUPS, machine), architecture.numbers[call], architecture.audit, *arguments
    )
    assert (said != ALLOW) is is_refused


SPECIAL = {
    "set-user-id": ("chmod", (0, 0o4755), True),
    "set-group-id": ("fchmod", (0, 0o2755), True),
    "so, with bits that the kernel does not look at": ("fchmodat", (0, 0, 0xFFFF_0001_4755), True),
    "sticky": ("chmod", (0, 0o1777), False),
    "private": ("fchmodat", (0, 0, 0o600), False),
    "a new one": ("openat", (0, 0, os.O_CREAT | os.O_WRONLY, 0o4755), True),
    "a new one without a name": ("openat", (0, 0, os.O_TMPFILE | os.O_RDWR, 0o4755), True),
    "a new one, in the old way": ("open", (0, os.O_CREAT, 0o2755), True),
    "a new one, in the oldest way": ("creat", (0, 0o4755), True),
    "a plain new one": ("openat", (0, 0, os.O_CREAT | os.O_WRONLY, 0o644), False),
    "a folder, without a mode": ("openat", (0, 0, os.O_DIRECTORY, 0o4755), False),
    "one that is there, and no mode": ("open", (0, os.O_RDWR, 0o7777), False),
    "a file by mknod": ("mknodat", (0, 0, stat.S_IFREG | 0o4755), True),
    "a file by mknod, in the old way": ("mknod", (0, stat.S_IFREG | 0o2755), True),
    "a plain file by mknod": ("mknodat", (0, 0, stat.S_IFREG | 0o644), False),
    "a named pipe": ("mknodat", (0, 0, stat.S_IFIFO | 0o600), False),
    "a socket": ("mknod", (0, stat.S_IFSOCK | 0o600), False),
    "a character device": ("mknodat", (0, 0, stat.S_IFCHR | 0o600), True),
    "a block device": ("mknod", (0, stat.S_IFBLK | 0o600), True),
    "a mode in memory": ("openat2", (), True),
    "a mode with flags": ("fchmodat2", (0, 0, 0o600), True),
    "a pair of streams": ("socketpair", (1, 1), False),
    "a pair of datagram sockets": ("socketpair", (1, 2), False),
    "a pair of tipc": ("socketpair", (30, 1), True),
    "a pair of packets": ("socketpair", (17, 3), True),
}
FOR_RESTRICTED = {
    "neither to read nor to write": ("openat", (0, 0, 3), True),
    "the same, and truncate": ("open", (0, 3 | os.O_TRUNC), True),
    "to read and write": ("openat", (0, 0, os.O_RDWR | os.O_TRUNC | os.O_CLOEXEC), False),
    "to read, and truncate": ("openat", (0, 0, os.O_RDONLY | os.O_TRUNC), True),
    "the same, by the older call": ("open", (0, os.O_RDONLY | os.O_TRUNC), True),
    "truncate by path": ("truncate", (0, 0), True),
    "its own priority": ("setpriority", (0, 0, 19), False),
    "that of another": ("setpriority", (0, 1, 19), True),
    "that of all of its user": ("setpriority", (2, 0, 19), True),
    "its own affinity": ("sched_setaffinity", (0,), False),
    "its own affinity, with more bits": ("sched_setaffinity", (1 << 32,), False),
    "that of others": ("sched_setaffinity", (1,), True),
    "policy of another": ("sched_setscheduler", (1,), True),
    "parameters of another": ("sched_setparam", (1,), True),
    "attributes of another": ("sched_setattr", (1,), True),
    "its own disk priority": ("ioprio_set", (1, 0), False),
    "disk priority of another": ("ioprio_set", (1, 1), True),
    "disk priority of all of its user": ("ioprio_set", (3, 0), True),
}


TOGETHER = [
    (machine, case)
    for machine, architecture in ARCHITECTURES.items()
    for case, (call, *_) in {**SPECIAL, **FOR_RESTRICTED}.items()
    if call in architecture.numbers
]


@pytest.mark.parametrize(("machine", "case"), TOGETHER)
def test_several_arguments_decide_together(machine: str, case: str) -> None:
    call, arguments, is_refused = {**SPECIAL, **FOR_RESTRICTED}[case]
    architecture = ARCHITECTURES[machine]
    code = filter_of(GROUPS if case in SPECIAL else EVERY, machine)
    said = run(code, architecture.numbers[call], architecture.audit, *arguments)
    assert (said != ALLOW) is is_refused


@pytest.mark.parametrize("call", ["chmod", "fchmod", "fchmodat", "utimensat"])
def test_what_copying_a_file_calls_does_nothing_where_the_user_is_the_hosts(call: str) -> None:
    code = filter_of({**GROUPS, **WITH_THE_HOSTS_USER}, "x86_64")
    assert run(code, X86.numbers[call], X86.audit, 0, 0, 0) == ERROR | 0
    assert run(filter_of(GROUPS, "x86_64"), X86.numbers[call], X86.audit, 0, 0, 0) == ALLOW


def test_touching_a_path_fails_there_so_that_the_file_is_made_instead() -> None:
    code, call = filter_of({**GROUPS, **WITH_THE_HOSTS_USER}, "x86_64"), X86.numbers["utimensat"]
    path, times = 0x7000, 0x8000
    assert run(code, call, X86.audit, 0, path, 0) == ERROR | errno.EPERM
    assert run(code, call, X86.audit, 0, path, times) == ERROR | 0
    assert run(code, call, X86.audit, 0, 0, 0) == ERROR | 0, "of what is open already"


@pytest.mark.parametrize("has_network", [False, True])
def test_no_pair_sends_datagrams_where_sockets_of_other_processes_are_near(
    has_network: bool,
) -> None:
    code = filter_of({"sockets": SOCKETS_OF_THE_HOST[has_network]}, "x86_64")
    more = 0o2004000  # SOCK_NONBLOCK, SOCK_CLOEXEC

    def is_refused(kind: int) -> bool:
        return run(code, X86.numbers["socketpair"], X86.audit, 1, kind | more) != ALLOW

    assert [kind for kind in range(1, 6) if is_refused(kind)] == [2, 3]


def test_without_a_network_of_its_own_no_socket_is_to_be_had() -> None:
    code = filter_of({"sockets": SOCKETS_OF_THE_HOST[False]}, "x86_64")
    said = {family: run(code, X86.numbers["socket"], X86.audit, family) for family in range(64)}
    assert set(said.values()) == {ERROR | 97}


def test_each_call_is_known_to_some_machine() -> None:
    known = {*X86.numbers, *ARM.numbers}
    assert {rule.call for rule in ALL} <= known
