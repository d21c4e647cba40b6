"""What was measured. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from demo.fall import Fall


@dataclass(frozen=True, slots=True)
class Stop:
    """One stop while a plan ran, in seconds after a person had done their part."""

    asked_s: float
    """Until every behaviour that ran had been asked to halt."""
    ended_s: float
    """Until the last of them had ended."""

    @classmethod
    def of(
        cls, journal: Iterable[Mapping[str, Any]], actions: Collection[str], since_s: float
    ) -> Stop:
        """Read it from a journal's rows since before the stop; `actions` are those that ran.

        Raises `ValueError` if they did not all go down, or not yet.
        """
        rows = list(journal)
        fall = Fall.of(rows)
        down: set[str] = set()
        asked_s = None
        for row in (row for row in rows if row["event"] == "BehavioursHalted"):
            down |= {*row["detail"]["halted"], *row["detail"]["lost"]}
            if down >= {*actions}:
                asked_s = row["monotonic"]
                break
        if asked_s is None or len(fall.endings) < len(actions):
            raise ValueError(f"of {sorted(actions)} only {sorted(down)} went down")
        return cls(asked_s - since_s, max(ending.at_s for ending in fall.endings) - since_s)


@dataclass(frozen=True, slots=True)
class Way:
    """A way to stop, in one demonstration."""

    where: str
    how: str
    stops: tuple[Stop, ...]
    missed: int = 0
    """How often it was tried in vain."""


@dataclass(frozen=True, slots=True)
class Spoken:
    """One clip, and what was heard."""

    text: str
    voice: str
    heard: str | None
    """The sentence that was taken for said; None: none."""
    is_stop: bool
    """Whether that stops a robot."""
    after_s: float | None = None
    """From the end of the last word until it was taken for said."""
    sound_s: float | None = None
    """How much of that was sound which had to come: the same on every machine."""


@dataclass(frozen=True, slots=True)
class Hearing:
    """Words that stop, and others, heard in one circumstance."""

    circumstance: str
    stops: tuple[Spoken, ...]
    """Words that stop were said."""
    others: tuple[Spoken, ...] = ()

    @property
    def understood(self) -> tuple[Spoken, ...]:
        """The stops that would have stopped the robot."""
        return tuple(one for one in self.stops if one.is_stop)

    @property
    def mistaken(self) -> tuple[Spoken, ...]:
        """The stops that were taken for something else."""
        return tuple(one for one in self.stops if one.heard is not None and not one.is_stop)

    @property
    def false(self) -> tuple[Spoken, ...]:
        """The sentences that are none and would have stopped it."""
        return tuple(one for one in self.others if one.is_stop)


@dataclass(frozen=True, slots=True)
class Results:
    """All of a run."""

    rounds: int
    calm: tuple[bool, ...]
    """Of each part, whether the machine had nothing else to do when it began."""
    ways: tuple[Way, ...] = ()
    hearings: tuple[Hearing, ...] = ()
    notes: tuple[str, ...] = field(default=())
