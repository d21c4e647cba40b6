"""Classic BPF programs that refuse system calls: a small assembler, pure.

Sources: linux/filter.h, linux/seccomp.h, seccomp(2). A program looks at `struct seccomp_data`: the
call's number, the architecture, and six arguments of 64 bits, of which only the low halves are
looked at here: all arguments that matter are `int` or `unsigned int` to the kernel.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence

from nondum.host.sandbox.levels.system_calls import Architecture
from nondum.sdk.frozen import frozen

_LOAD = 0x20  # BPF_LD | BPF_W | BPF_ABS
_IF_EQUAL = 0x15  # BPF_JMP | BPF_JEQ | BPF_K
_IF_GREATER_OR_EQUAL = 0x35  # BPF_JMP | BPF_JGE | BPF_K
_IF_ANY_BIT = 0x45  # BPF_JMP | BPF_JSET | BPF_K
_AND = 0x54  # BPF_ALU | BPF_AND | BPF_K
_RETURN = 0x06  # BPF_RET | BPF_K

ALLOW = 0x7FFF0000  # SECCOMP_RET_ALLOW
KILL = 0x80000000  # SECCOMP_RET_KILL_PROCESS
ERROR = 0x00050000  # SECCOMP_RET_ERRNO; the number is in the low 16 bits

_NUMBER = 0
_ARCHITECTURE = 4
_ARGUMENTS = 16
LONGEST = 4096  # BPF_MAXINSNS


@frozen
class Rule:
    """One system call that is refused, always or for some values of one argument."""

    call: str
    error: int
    """What it fails with (errno); 0: it does nothing, and answers that it did."""
    argument: int = 0
    """Which argument decides."""
    mask: int = 0xFFFFFFFF
    """The bits of it that are compared."""
    equal: tuple[int, ...] = ()
    """Refused for these values."""
    any_bit: int = 0
    """Refused when any of these bits is set."""
    other_than: tuple[int, ...] = ()
    """Refused for all values but these."""
    only_with: tuple[int, int] | None = None
    """An argument, and bits: refused only if one of these bits is set in it."""

    @property
    def is_always(self) -> bool:
        """Whether arguments do not matter."""
        return not (self.equal or self.any_bit or self.other_than)


@frozen
class Instruction:
    """`struct sock_filter`."""

    code: int
    value: int
    if_true: int = 0
    """Instructions to skip."""
    if_false: int = 0


def program(rules: Sequence[Rule], architecture: Architecture) -> tuple[Instruction, ...]:
    """The program that refuses what the rules say, and lets everything else pass.

    Calls of other architectures end the process: their numbers mean something else. A rule whose
    call the architecture does not have is left out.
    """
    made = (
        *_prologue(architecture),
        *(one for rule in rules for one in _refusal(rule, architecture)),
        Instruction(_RETURN, ALLOW),
    )
    assert len(made) <= LONGEST
    return made


def encoded(instructions: Sequence[Instruction]) -> bytes:
    """As the kernel and bubblewrap read it: `struct sock_filter` after the other."""
    return b"".join(
        struct.pack("=HBBI", one.code, one.if_true, one.if_false, one.value) for one in instructions
    )


def _prologue(architecture: Architecture) -> Iterator[Instruction]:
    yield Instruction(_LOAD, _ARCHITECTURE)
    yield Instruction(_IF_EQUAL, architecture.audit, if_true=1)
    yield Instruction(_RETURN, KILL)
    yield Instruction(_LOAD, _NUMBER)
    if architecture.foreign is not None:
        yield Instruction(_IF_GREATER_OR_EQUAL, architecture.foreign, if_false=1)
        yield Instruction(_RETURN, KILL)


def _refusal(rule: Rule, architecture: Architecture) -> Iterator[Instruction]:
    """Begins and ends with the call's number in the accumulator."""
    number = architecture.numbers.get(rule.call)
    if number is None:
        return
    refuse = Instruction(_RETURN, ERROR | rule.error)
    if rule.is_always:
        yield Instruction(_IF_EQUAL, number, if_false=1)
        yield refuse
        return
    judged = (_load(rule.argument), Instruction(_AND, rule.mask), *_judged(rule, refuse))
    body = (*_condition(rule, len(judged)), *judged)
    reload = Instruction(_LOAD, _NUMBER)
    yield Instruction(_IF_EQUAL, number, if_false=len(body) + 1)
    yield from body
    yield reload


def _load(argument: int) -> Instruction:
    return Instruction(_LOAD, _ARGUMENTS + 8 * argument)


def _condition(rule: Rule, length: int) -> Iterator[Instruction]:
    """Skip the rule, which is the next `length` instructions, unless its condition holds."""
    if rule.only_with is not None:
        argument, bits = rule.only_with
        yield _load(argument)
        yield Instruction(_IF_ANY_BIT, bits, if_false=length)


def _judged(rule: Rule, refuse: Instruction) -> Iterator[Instruction]:
    for value in rule.equal:
        yield Instruction(_IF_EQUAL, value, if_false=1)
        yield refuse
    if rule.any_bit:
        yield Instruction(_IF_ANY_BIT, rule.any_bit, if_false=1)
        yield refuse
    if rule.other_than:
        last = len(rule.other_than) - 1
        for index, value in enumerate(rule.other_than):  # each good value leads past the refusal
            yield Instruction(_IF_EQUAL, value, if_true=last - index + 1)
        yield refuse
