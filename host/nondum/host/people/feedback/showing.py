"""Which of all state reasons is shown, and until when. Pure: the caller passes the time.

Some states are news, and are shown for a while only: a refusal that was seen is in every status,
and must not hide for ever that the next drive is well. What is gone, pulled for instance, is shown
no longer in any case.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TypeAlias

from nondum.host.core.feedback_state import NOTHING, PRIORITY, State, StateReason
from nondum.sdk.frozen import frozen

Since: TypeAlias = Mapping[tuple[State, str, str], float]
"""State, what about, and code → when it was first known, in seconds of a clock that only rises."""


@frozen
class Durations:
    """How long news are shown."""

    refused_s: float
    safe_s: float

    def of(self, state: State) -> float | None:
        """How long a state is shown; None: as long as it lasts."""
        return {State.REFUSED: self.refused_s, State.SAFE: self.safe_s}.get(state)


@frozen
class Shown:
    """What is shown now."""

    reason: StateReason
    until_s: float | None
    """When it ends by itself, by the same clock; None: it does not."""


def since(before: Since, reasons: Iterable[StateReason], now_s: float) -> Since:
    """When each of the current reasons was first known."""
    return {_key(reason): before.get(_key(reason), now_s) for reason in reasons}


def shown(
    reasons: Iterable[StateReason], known: Since, now_s: float, durations: Durations
) -> Shown:
    """The reason that is shown: of the first state by `PRIORITY`, the newest. That a drive may be
    pulled is shown only until help is needed, and says so where it was needed before."""
    open_ones = []
    for reason in reasons:
        duration, began_s = durations.of(reason.state), known[_key(reason)]
        until_s = None if duration is None else began_s + duration
        if until_s is None or now_s < until_s:
            rank = PRIORITY.index(_alike(reason.state))
            is_safe = reason.state is State.SAFE
            open_ones.append((rank, -began_s, is_safe, reason.about, reason))
    if not open_ones:
        return Shown(NOTHING, None)
    open_ones.sort(key=lambda found: found[:4])
    _, newest, _, _, first = open_ones[0]
    duration = durations.of(first.state)
    help = next((found[4] for found in open_ones if found[4].state is State.HELP), None)
    if first.state is State.SAFE and help is not None:
        first = replace(
            first, sentence=f"{first.sentence}; help is needed all the same: {help.sentence}"
        )
    return Shown(first, None if duration is None else duration - newest)


def _alike(state: State) -> State:
    """Of help that is needed and a drive that may be pulled, the newest is shown."""
    return State.HELP if state is State.SAFE else state


def _key(reason: StateReason) -> tuple[State, str, str]:
    return reason.state, reason.about, reason.code
