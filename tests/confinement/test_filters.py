"""The filter of system calls: a program for the kernel, run here by an interpreter of its own."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.confinement.filters import ALLOW, ERROR, KILL, Rule, encoded, program
from nondum.host.confinement.refusals import GROUPS, SOCKETS_OF_THE_HOST, filter_of
from nondum.host.confinement.system_calls import ARCHITECTURES, Architecture

X86, ARM = ARCHITECTURES["x86_64"], ARCHITECTURES["aarch64"]
ALL = tuple(rule for group in GROUPS.values() for rule in group)
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
        holds = {
            0x15: accumulator == value,
            0x35: accumulator >= value,
            0x45: bool(accumulator & value),
        }[operation]
        at += if_true if holds else if_false


def refused(rule: Rule, argument: int) -> bool:
    if rule.is_always:
        return True
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
    wanted = next((ERROR | r.error for r in rules if refused(r, arguments[r.argument])), ALLOW)
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
        pytest.param("ioctl", 1, 0x1_0000_5412, True, id="so, with bits that nobody looks at"),
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


def test_without_a_network_of_its_own_no_socket_is_to_be_had() -> None:
    code = filter_of({"sockets": SOCKETS_OF_THE_HOST[False]}, "x86_64")
    said = {family: run(code, X86.numbers["socket"], X86.audit, family) for family in range(64)}
    assert set(said.values()) == {ERROR | 97}


def test_each_call_is_known_to_some_machine() -> None:
    known = {*X86.numbers, *ARM.numbers}
    assert {rule.call for rule in ALL} <= known
