"""How big a domain may be once it is written out, and who is to blame where it is bigger."""

from __future__ import annotations

from collections.abc import Sequence

from nondum.planning.ground.join import Work
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
