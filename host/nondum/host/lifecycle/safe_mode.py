"""Safe mode: payloads are left alone by a daemon before which others died, or that is told to.

`tries` finds out which drive or payload daemons die of. What it does not catch is caught here: what
is installed for good and never blamed, what kills a daemon by ways that no drive stands for, and
what kills it later than it looks.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from nondum.host.core.records.drive import INSTALLED
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import crash_attribution
from nondum.sdk.errors import Problem

CODE = "SAFE_MODE"
DEATHS = 8
"""Daemons in a row that died soon, after which the next one leaves guests alone. More than
`crash_attribution.ATTEMPTS`: one bad drive is no reason for it."""
MORE_DEATHS = 12
"""The same, after which the next one also leaves alone what is installed for good."""
KERNEL_WORD = "nondum.safe"

_ORDER = (Safety.OFF, Safety.INITIAL, Safety.NOTHING)


def after_deaths(deaths: int) -> Safety:
    """The safe mode after a number of daemons in a row that died soon.

    >>> [after_deaths(n).name for n in (0, 7, 8, 12)]
    ['OFF', 'OFF', 'INITIAL', 'NOTHING']
    """
    if deaths >= MORE_DEATHS:
        return Safety.NOTHING
    return Safety.INITIAL if deaths >= DEATHS else Safety.OFF


def asked_of_kernel(command_line: str) -> Safety:
    """What the kernel's command line asks for: `nondum.safe`, or `nondum.safe=nothing`.

    >>> asked_of_kernel("quiet nondum.safe").name
    'INITIAL'
    """
    asked = [word for word in command_line.split() if word.partition("=")[0] == KERNEL_WORD]
    return strictest(said(word.partition("=")[2]) for word in asked)


def said(word: str) -> Safety:
    """What somebody asks for who asks for safe mode, in whatever words."""
    return Safety.NOTHING if word.strip() == Safety.NOTHING.value else Safety.INITIAL


def strictest(wanted: Iterable[Safety]) -> Safety:
    """The one that leaves most alone."""
    return max(wanted, key=_ORDER.index, default=Safety.OFF)


def problem(safety: Safety, where: str = "", why: str = "") -> Problem:
    """What is told of the host, of a drive or of a payload."""
    guests = "payloads of drives and other hosts" if safety is Safety.INITIAL else "all payloads"
    told = f"{guests} are left alone{f': {why}' if why else ''}"
    return Problem(CODE, told, where=where)


def is_left_alone(safety: Safety, *, is_initial: bool) -> bool:
    """Whether a payload may not be at work."""
    return safety is Safety.NOTHING or (safety is Safety.INITIAL and not is_initial)


def drive_problems(state: HostState, kind: str, where: str) -> tuple[Problem, ...]:
    """What there is against looking at a drive, or taking in what is on it."""
    left = is_left_alone(state.safety, is_initial=kind == INSTALLED)
    return (problem(state.safety, where),) if left else ()


def waits(payload: PayloadRecord) -> bool:
    """Whether a payload would be at work but for safe mode."""
    return payload.step is Step.QUARANTINED and [p.code for p in payload.problems] == [CODE]


def roused(state: HostState, safety: Safety) -> Mapping[str, PayloadRecord]:
    """The payloads that a daemon finds: those that waited for the last one's safe mode to end are
    as they were, if this one lets them."""
    return {
        key: replace(payload, step=Step.STORED, problems=())
        if waits(payload)
        and not is_left_alone(safety, is_initial=crash_attribution.is_initial(state, payload))
        else payload
        for key, payload in state.payloads.items()
    }
