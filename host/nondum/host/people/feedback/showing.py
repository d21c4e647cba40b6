"""Which of all concerns is shown, and until when. Pure: the time is told.

Some states are news, and are shown for a while only: a refusal that was seen is in every status,
and must not hide for ever that the next drive is well. What is gone, pulled for instance, is shown
no longer in any case.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from nondum.host.core.feedback_state import NOTHING, PRIORITY, Concern, State

Since: TypeAlias = Mapping[tuple[State, str, str], float]
"""State, what about, and code → when it was first known, in seconds of a clock that only rises."""


@dataclass(frozen=True, slots=True)
class Durations:
    """How long news are shown."""

    refused_s: float
    safe_s: float

    def of(self, state: State) -> float | None:
        """How long a state is shown; None: as long as it lasts."""
        return {State.REFUSED: self.refused_s, State.SAFE: self.safe_s}.get(state)


@dataclass(frozen=True, slots=True)
class Shown:
    """What is shown now."""

    concern: Concern
    until_s: float | None
    """When it ends by itself, by the same clock; None: it does not."""


def since(before: Since, concerns: Iterable[Concern], now_s: float) -> Since:
    """When each of the concerns that there are now was first known."""
    return {_key(concern): before.get(_key(concern), now_s) for concern in concerns}


def shown(concerns: Iterable[Concern], known: Since, now_s: float, durations: Durations) -> Shown:
    """The concern that is shown: of the first state by `PRIORITY`, the newest. That a drive may be
    pulled is shown only until help is needed, and says so where it was needed before."""
    open_ones = []
    for concern in concerns:
        duration, began_s = durations.of(concern.state), known[_key(concern)]
        until_s = None if duration is None else began_s + duration
        if until_s is None or now_s < until_s:
            rank = PRIORITY.index(_alike(concern.state))
            is_safe = concern.state is State.SAFE
            open_ones.append((rank, -began_s, is_safe, concern.about, concern))
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


def _key(concern: Concern) -> tuple[State, str, str]:
    return concern.state, concern.about, concern.code
