"""Who takes how much of the work that writing a task out may take."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from nondum.planning.ground.bounds import TooManyBindings
from nondum.planning.ground.join import TooMuchWork, Work
from nondum.planning.merge.domain import Origin


@dataclass(slots=True)
class Spending:
    """The work that is left, and what each action, rule or goal has taken of it."""

    work: Work
    _spent: Counter[str] = field(default_factory=Counter)
    _origins: dict[str, Sequence[Origin]] = field(default_factory=dict)

    @contextmanager
    def by(self, name: str, origins: Sequence[Origin] = ()) -> Iterator[None]:
        """Count what is taken inside as taken by `name`.

        Raises `TooManyBindings` that blames who took most, when nothing is left.
        """
        before = self.work.left
        self._origins[name] = origins
        try:
            yield
        except TooMuchWork:
            self._spent[name] += before
            raise self._too_much() from None
        self._spent[name] += before - self.work.left

    def _too_much(self) -> TooManyBindings:
        name, _ = max(self._spent.items(), key=lambda spent: (spent[1], spent[0]))
        return TooManyBindings.of(
            f"what {name!r} says of all or some objects is too much to write out",
            self._origins[name],
            fix="quantify over fewer variables, or over narrower types",
        )
