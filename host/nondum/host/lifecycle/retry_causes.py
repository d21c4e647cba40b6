"""Which refusals have a cause that can go away, and when such a payload is tried again. Pure.

A refusal for lack of disk or memory, or by a clock that was wrong, is no fault of the payload. Once
the cause is gone the host tries again by itself; later and later, where that is in vain.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import replace
from enum import Enum

from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

FIRST_S = 5.0
"""From a refusal until the first try."""
LONGEST_S = 600.0
"""Between two tries; each time twice as long is waited, up to this."""
CLOCK_SET_S = 30.0
"""A clock that goes so far from where it was going was set."""
_UNIT = " MB"


class Cause(Enum):
    """What can go away by itself, or by what people do on this host, not to the payload."""

    DISK = "there is more free disk now"
    MEMORY = "there is more free memory now"
    GPU_MEMORY = "there is more free GPU memory now"
    CLOCK = "the clock was set"


CAUSES: Mapping[str, Cause] = {
    "DISK_FULL": Cause.DISK,
    "NO_MEMORY": Cause.MEMORY,
    "NO_GPU_MEMORY": Cause.GPU_MEMORY,
    "SIG_EXPIRED": Cause.CLOCK,
    "SIG_NOT_YET": Cause.CLOCK,
}
"""Codes of refusals that are tried again when their cause is gone."""

UNTRUSTED = frozenset(
    {"ID_NOT_ALLOWED", "SIG_EXPIRED", "SIG_NOT_YET", "SIG_TOO_FEW", "SIG_UNTRUSTED"}
)
"""Codes of refusals that another trust file may end."""

UNSIGNED = UNTRUSTED | {"SIG_INVALID", "SIG_MALFORMED", "SIG_MISSING", "SIG_WRONG_PURPOSE"}
"""Codes of refusals that other signatures may end."""

HELPED_BY_RETRY = frozenset(
    {
        "CHILD_DIED",
        "CHILD_LIMIT",
        "CHILD_STALLED",
        "HELPER_BUSY",
        "HELPER_FAILED",
        "HELPER_SILENT",
        "IO_ERROR",
        "NO_RESOURCES",
        "STORE_DAMAGED",
        "STORE_MISSING",
    }
)
"""Codes whose cause is on this host as well, but cannot be seen to go away: a person asks."""


HELPER_UNAVAILABLE = frozenset({"HELPER_BUSY", "HELPER_SILENT"})
"""Codes of drives that the root helper did not get to; it may be about to start."""
MOST_READINGS = 5
"""How often such a drive is read again by itself."""


@frozen
class Amounts:
    """What this host has now, as far as payloads were refused for it."""

    disk_mb: int
    """Free disk, less what is reserved."""
    memory_mb: int
    """Memory that is promised to no payload."""
    gpu_memory_mb: int
    clock_s: float
    """Seconds from the start of the machine's steady clock to the epoch: another once the clock has
    been set."""

    def of(self, cause: Cause) -> int:
        """The amount that a cause is about; of the clock there is none."""
        match cause:
            case Cause.DISK:
                return self.disk_mb
            case Cause.MEMORY:
                return self.memory_mb
            case Cause.GPU_MEMORY:
                return self.gpu_memory_mb
            case Cause.CLOCK:
                return 0


@frozen
class Waiting:
    """A refused payload of which the causes may go away."""

    at_refusal: Amounts
    not_before_s: float
    """By the steady clock."""
    tries: int = 0


@frozen
class Unread:
    """A drive that the helper did not get to."""

    not_before_s: float
    """When it is read again, by the steady clock."""
    readings: int = 0
    """How often it was read again."""


@frozen
class Due:
    """A payload that is to be tried now."""

    payload: str
    """Its key."""
    why: str


def waits(snapshot: Snapshot, elsewhere: Set[str] = frozenset()) -> Iterator[PayloadRecord]:
    """The payloads that would be tried again; not those that run `elsewhere` meanwhile (keys)."""
    return (
        payload
        for payload in snapshot.payloads
        if payload.step in (Step.REFUSED, Step.QUARANTINED)
        and payload.key not in elsewhere
        and is_passing(payload.problems)
    )


def is_passing(problems: Iterable[Problem]) -> bool:
    """Whether all causes of a refusal can go away.

    >>> is_passing([Problem("DISK_FULL", "no space")])
    True
    >>> is_passing([Problem("DISK_FULL", "no space"), Problem("WHEEL_RECORD", "wrong")])
    False
    """
    codes = {problem.code for problem in problems}
    return bool(codes) and codes <= CAUSES.keys()


def is_untrusted(problems: Iterable[Problem]) -> bool:
    """Whether a refusal is of those that another trust file may end."""
    codes = {problem.code for problem in problems}
    return bool(codes) and codes <= UNTRUSTED


def is_unsigned(problems: Iterable[Problem]) -> bool:
    """Whether a refusal is of those that other signatures may end."""
    codes = {problem.code for problem in problems}
    return bool(codes) and codes <= UNSIGNED


def due(
    waiting: Mapping[str, Waiting],
    refused: Iterable[PayloadRecord],
    working: Set[str],
    now: Amounts,
    now_s: float,
) -> tuple[dict[str, Waiting], tuple[Due, ...]]:
    """What waits from now on, and what is to be tried.

    `refused` are those that `waits` gives, `working` the keys of payloads that work: what is tried
    is counted until it does, or is gone.
    """
    refused = tuple(refused)
    here = {payload.key for payload in refused}
    # What is just being tried is neither refused nor at work, and for a moment not known at all.
    kept = {
        key: one
        for key, one in waiting.items()
        if key in here or (key not in working and now_s < one.not_before_s)
    }
    tried: list[Due] = []
    for payload in refused:
        one = kept.get(payload.key) or Waiting(now, now_s + FIRST_S)
        if now_s >= one.not_before_s and _are_gone(payload.problems, one.at_refusal, now):
            whys = dict.fromkeys(CAUSES[problem.code].value for problem in payload.problems)
            tried.append(Due(payload.key, " and ".join(whys)))
            one = replace(
                one,
                at_refusal=now,
                not_before_s=now_s + min(LONGEST_S, FIRST_S * 2 ** (one.tries + 1)),
                tries=one.tries + 1,
            )
        kept[payload.key] = one
    return kept, tuple(tried)


def drives_due(
    unread: Mapping[str, Unread], drives: Iterable[DriveRecord], now_s: float
) -> tuple[dict[str, Unread], tuple[str, ...]]:
    """The drives that the helper did not get to, and those of them to read again now.

    Each is read again `MOST_READINGS` times at most, each time after twice as long; a drive that
    could be read, or is pulled, begins from the start.
    """
    kept: dict[str, Unread] = {}
    again: list[str] = []
    for drive in drives:
        one = unread.get(drive.id)
        if drive.state is DriveState.IDLE and is_unread(drive.problems):
            one = one or Unread(now_s + FIRST_S)
            if now_s >= one.not_before_s and one.readings < MOST_READINGS:
                again.append(drive.id)
                wait_s = min(LONGEST_S, FIRST_S * 2 ** (one.readings + 1))
                one = Unread(now_s + wait_s, one.readings + 1)
        elif drive.state is not DriveState.READING:
            continue
        if one is not None:
            kept[drive.id] = one
    return kept, tuple(again)


def is_unread(problems: Iterable[Problem]) -> bool:
    """Whether the helper is all that kept a drive from being read."""
    codes = {problem.code for problem in problems}
    return bool(codes) and codes <= HELPER_UNAVAILABLE


def foretold(problems: Iterable[Problem], payload_id: str) -> tuple[Problem, ...]:
    """The problems of a refusal, with what comes of it once people have done what they are told."""
    problems = tuple(problems)
    if is_passing(problems):
        return tuple(_with(p, "then it is tried again by itself") for p in problems)
    if all(problem.code in CAUSES.keys() | HELPED_BY_RETRY for problem in problems):
        return tuple(_with(p, f"then `nondum retry {payload_id}`") for p in problems)
    return problems


def _with(problem: Problem, what: str) -> Problem:
    return replace(problem, fix=f"{problem.fix}; {what}" if problem.fix else what)


def _are_gone(problems: Iterable[Problem], at_refusal: Amounts, now: Amounts) -> bool:
    return all(_is_gone(problem, at_refusal, now) for problem in problems)


def _is_gone(problem: Problem, at_refusal: Amounts, now: Amounts) -> bool:
    """There is as much as was needed, or, where that is not known, more than there was."""
    cause = CAUSES[problem.code]
    if cause is Cause.CLOCK:
        return abs(now.clock_s - at_refusal.clock_s) >= CLOCK_SET_S
    needed = problem.need.removesuffix(_UNIT)
    if needed.isdecimal():
        return now.of(cause) >= int(needed)
    return now.of(cause) > at_refusal.of(cause)
