"""What the good workers' calls and frames took, in a span of time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from benchmarks.measuring import percentile

FEW = 100
"""No 99th percentile is taken of fewer measurements."""


class Span(NamedTuple):
    """From when until when."""

    begun_s: float
    over_s: float


class Call(NamedTuple):
    """One call of a good worker."""

    begun_s: float
    took_s: float


class Frame(NamedTuple):
    """One frame that was seen."""

    number: int
    made_s: float
    seen_s: float


@dataclass(frozen=True)
class Window:
    """All that was under way in a span of time."""

    calls_ms: tuple[float, ...]
    frames_ms: tuple[float, ...]
    lost: int
    """Frames that were made and not seen."""


def window(calls: Iterable[Call], frames: Iterable[Frame], span: Span) -> Window:
    """What of it lay in that span, be it in part.

    >>> frames = [Frame(1, 0.0, 0.1), Frame(2, 1.0, 1.5), Frame(4, 3.0, 3.25)]
    >>> window([Call(0.0, 0.1), Call(0.9, 0.2)], frames, Span(1.0, 4.0))
    Window(calls_ms=(200.0,), frames_ms=(500.0, 250.0), lost=1)
    """
    begun_s, over_s = span
    seen = [frame for frame in frames if frame.seen_s >= begun_s and frame.made_s <= over_s]
    return Window(
        tuple(
            call.took_s * 1e3
            for call in calls
            if call.begun_s + call.took_s >= begun_s and call.begun_s <= over_s
        ),
        tuple((frame.seen_s - frame.made_s) * 1e3 for frame in seen),
        sum(later.number - earlier.number - 1 for earlier, later in pairwise(seen)),
    )


def p99(windows: Iterable[Iterable[float]]) -> float | None:
    """Of all windows together; None where they have too few.

    >>> p99([range(100), range(100)]), p99([range(50)])
    (98, None)
    """
    together = [value for one in windows for value in one]
    return percentile(together, 99) if len(together) >= FEW else None
