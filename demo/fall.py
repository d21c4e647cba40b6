"""How behaviours went down after a loss, as the journal tells it: in which ticks, and how they
ended. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

HALTED_S = 1.0
"""How long a behaviour may take to end once it was asked to: less than the host's own patience,
after which it ends the worker."""

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Ending:
    """The end of a behaviour."""

    component: str
    outcome: str
    at_s: float


@dataclass(frozen=True, slots=True)
class Fall:
    """All that went down in a stretch of the journal."""

    ticks: tuple[frozenset[str], ...]
    """The actions that went down in each tick in which any did."""
    loss: int
    """The first of these ticks in which a component was gone; the first of all where none was. On a
    slow machine a stream may stop flowing a moment before that, and what reads it goes down."""
    ticks_s: tuple[float, ...]
    """When each of these ticks was (monotonic clock)."""
    endings: tuple[Ending, ...]
    exits: tuple[str, ...]
    """Components whose worker ended."""

    @classmethod
    def of(cls, journal: Iterable[Row]) -> Fall:
        """Read a journal's rows, oldest first."""
        rows = list(journal)
        halts = [row for row in rows if row["event"] == "BehavioursHalted"]
        loss = next((n for n, row in enumerate(halts) if row["detail"]["lost"]), 0)
        return cls(
            ticks=tuple(
                frozenset({*row["detail"]["halted"], *row["detail"]["lost"]}) for row in halts
            ),
            loss=loss,
            ticks_s=tuple(row["monotonic"] for row in halts),
            endings=tuple(_ending(row) for row in rows if row["event"] == "BehaviourEnded"),
            exits=tuple(row["subject"] for row in rows if row["event"] == "WorkerExited"),
        )

    @property
    def decided_s(self) -> float:
        """When the first of these ticks was (monotonic clock); 0 when there was none."""
        return self.ticks_s[0] if self.ticks_s else 0.0

    @property
    def took_s(self) -> float:
        """From the decision until the last behaviour had ended."""
        return max((ending.at_s for ending in self.endings), default=0.0) - self.decided_s

    def faults(self, actions: Collection[str], components: Collection[str]) -> Iterator[str]:
        """What is wrong with it, if `actions` had to go down no later than in the tick of the loss,
        and the behaviours of `components` had to end by themselves."""
        if not self.ticks:
            yield "nothing was halted"
        else:
            then = self.loss + 1
            for action in {*actions}.difference(*self.ticks[:then]):
                is_late = any(action in tick for tick in self.ticks[then:])
                yield f"{action} was {'halted in a later tick' if is_late else 'not halted'}"
        for component in components:
            yield from self._lateness(component)
            if component in self.exits:
                yield f"the worker of {component} ended"

    def _lateness(self, component: str) -> Iterator[str]:
        ending = next((one for one in self.endings if one.component == component), None)
        if ending is None:
            yield f"what {component} did has not ended"
        elif ending.outcome != "HALTED":
            yield f"what {component} did {ending.outcome.lower()}"
        elif (took_s := ending.at_s - self._asked_s(component)) > HALTED_S:
            yield f"what {component} did took {took_s:.1f} s to end"

    def _asked_s(self, component: str) -> float:
        """When the behaviour of a component was asked to end: in the first tick in which one of its
        actions went down."""
        fell = zip(self.ticks, self.ticks_s, strict=True)
        of_it = (at for tick, at in fell if any(a.startswith(f"{component}.") for a in tick))
        return next(of_it, self.decided_s)


def _ending(row: Row) -> Ending:
    return Ending(row["subject"], row["detail"]["outcome"], row["monotonic"])
