"""How big a domain may be once it is written out, and who is to blame where it is bigger."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from nondum.planning.ground.join import TooMuchWork, Work
from nondum.planning.merge.domain import Origin
from nondum.sdk.errors import FragmentRefused, Problem

INSTANCES_LIMIT = 100_000
"""Ground actions that a domain may have."""

_WORK_PER_INSTANCE = 50
"""Objects and facts that may be looked at in vain, for each ground action that there may be."""


class TooManyBindings(FragmentRefused):
    """A domain that is too big to be written out. `components` brought what is widest in it."""

    def __init__(self, problem: Problem, components: frozenset[str]) -> None:
        super().__init__(problem)
        self.components = components

    @classmethod
    def of(cls, message: str, origins: Sequence[Origin], *, fix: str) -> TooManyBindings:
        """PDDL_TOO_MANY, with the places that it is about."""
        problem = Problem("PDDL_TOO_MANY", message, " and ".join(map(str, origins)), fix=fix)
        return cls(problem, frozenset(origin.component for origin in origins))


def work_for(limit: int) -> Work:
    """The bindings that may be looked at where up to `limit` may be made."""
    return Work(_WORK_PER_INSTANCE * limit)


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
