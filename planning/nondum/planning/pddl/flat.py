"""A condition as a join sees it: variables, literals, and what is left to decide afterwards."""

from __future__ import annotations

from collections.abc import Iterable

from nondum.planning.pddl.normal import Condition, condition_of, joined
from nondum.planning.pddl.syntax import Atom, Equal, Or, Quantified, TypedName, renamed
from nondum.sdk.frozen import frozen


@frozen
class Flat:
    """A conjunction in which what must merely exist has become a variable like others."""

    variables: tuple[TypedName, ...]
    """The given ones first."""
    positive: tuple[Atom, ...]
    negative: tuple[Atom, ...]
    equal: tuple[Equal, ...]
    unequal: tuple[Equal, ...]
    rest: tuple[Or | Quantified, ...]
    """Disjunctions, and what must hold of everything."""


def flat(variables: Iterable[TypedName], *conditions: Condition) -> Flat:
    """Flatten the conjunction of conditions over the given variables."""
    known = list(variables)
    condition = joined(conditions)
    rest: list[Or | Quantified] = []
    waiting = list(condition.further)
    while waiting:
        part = waiting.pop(0)
        if isinstance(part, Quantified) and part.quantifier == "exists":
            fresh = {v.name: f"{v.name}~{len(known) + i}" for i, v in enumerate(part.variables)}
            known += (TypedName(fresh[v.name], v.types, v.place) for v in part.variables)
            inner = condition_of(renamed(part.part, fresh))
            waiting += inner.further
            condition = joined((condition, inner))
        else:
            rest.append(part)
    return Flat(
        tuple(known),
        condition.positive,
        condition.negative,
        condition.equal,
        condition.unequal,
        tuple(rest),
    )
