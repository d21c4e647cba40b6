"""Which parts of a condition nothing can meet: the fewest of them, under any binding."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice, product

from nondum.planning.ground.matching import Binding, FactIndex, Pattern, matched
from nondum.planning.ground.members import domains_of
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import (
    And,
    Atom,
    Equal,
    Formula,
    Not,
    Or,
    Quantified,
    TypedName,
    renamed,
    terms_of,
)
from nondum.planning.pddl.typegraph import types_or_root
from nondum.sdk.frozen import frozen

_PARTIAL_BINDINGS_LIMIT = 2000
"""How many are tried for one condition; beyond it the best ones so far are told."""
_TIES_LIMIT = 6
"""Equally small sets of missing parts that are told, at most."""
_INSTANCES_LIMIT = 200
"""Objects of a `forall` that are looked at, at most."""

Missing = tuple[Formula, ...]
"""Literals, their variables replaced where they are bound; an `exists` of which there is none."""


@frozen
class Outlook:
    """What can become true, and what can never become false."""

    reachable: FactIndex
    lasting: frozenset[str]
    """Facts that hold, and that nothing makes false."""
    members: Mapping[str, frozenset[str]]
    """Type → the objects of it."""


@dataclass(slots=True)
class Shortfall:
    """Branch and bound over the bindings of one condition's variables."""

    parts: tuple[Formula, ...]
    domains: dict[str, frozenset[str]]
    """Variable → the objects that it may stand for."""
    types: dict[str, tuple[str, ...]]
    """Variable → its types."""
    outlook: Outlook
    _numbers: dict[Quantified, int] = field(default_factory=dict)
    _best: list[Missing] = field(default_factory=list)
    _size: int = 0
    _left: int = 0

    @classmethod
    def of(
        cls, variables: Iterable[TypedName], conditions: Iterable[Condition], outlook: Outlook
    ) -> Shortfall:
        """What conditions over these variables may lack."""
        found = tuple(variables)
        return cls(
            tuple(part for condition in conditions for part in condition.parts()),
            domains_of(found, outlook.members),
            {variable.name: types_or_root(variable.types) for variable in found},
            outlook,
        )

    def least(self, binding: Binding) -> tuple[Missing, ...]:
        """The smallest sets of parts that cannot be met; one empty set where all can be."""
        self._best, self._size = [], len(self.parts) + _INSTANCES_LIMIT
        self._left = _PARTIAL_BINDINGS_LIMIT
        self._walk(self.parts, binding, ())
        if not self._best:
            atoms = (part for part in self.parts if isinstance(part, Atom))
            return (tuple(renamed(atom, binding) for atom in atoms),)
        return tuple(self._best)

    def _walk(self, left: Sequence[Formula], binding: Binding, missing: Missing) -> None:
        self._left -= 1
        if self._left < 0 or len(missing) > self._size:
            return
        if not left:
            self._keep(tuple(dict.fromkeys(renamed(part, binding) for part in missing)))
            return
        index = min(range(len(left)), key=lambda i: self._turn(left[i], binding))
        part, others = left[index], (*left[:index], *left[index + 1 :])
        match part:
            case Atom():
                pattern = Pattern.of(part)
                for row in self.outlook.reachable.candidates(pattern, binding):
                    extended = matched(pattern, row, binding, self.domains)
                    if extended is not None:
                        self._walk(others, extended, missing)
                self._walk(others, binding, (*missing, part))
            case And():
                self._walk((*part.parts, *others), binding, missing)
            case Or() if part.parts:
                for alternative in part.parts:
                    self._walk((alternative, *others), binding, missing)
            case Quantified():
                opened = self._opened(part)
                lacking = missing if opened is not None else (*missing, part)
                self._walk((*(opened or ()), *others), binding, lacking)
            case _:
                is_met = self._is_met(part, binding)
                self._walk(others, binding, missing if is_met else (*missing, part))

    def _keep(self, missing: Missing) -> None:
        if len(missing) < self._size:
            self._best, self._size = [], len(missing)
        is_tie = len(missing) == self._size and missing not in self._best
        if is_tie and len(self._best) < _TIES_LIMIT:
            self._best.append(missing)
        if not missing:
            self._left = 0

    def _turn(self, part: Formula, binding: Binding) -> tuple[int, int]:
        """What is looked at first: what leaves least to try."""
        match part:
            case Atom():
                return 1, len(self.outlook.reachable.candidates(Pattern.of(part), binding))
            case And():
                return 0, 0
            case Quantified(quantifier="exists"):
                return 2, 0
            case Or():
                return 3, 0
            case Quantified():
                return 4, 0
        is_bound = all(not t.is_variable or t.name in binding for t in terms_of(part))
        return (0 if is_bound else 5), 0

    def _is_met(self, part: Formula, binding: Binding) -> bool:
        """Whether a comparison or the negation of an atom can hold; one that is open can."""
        match renamed(part, binding):
            case Not(part=Atom() as atom):
                return str(atom)[1:-1] not in self.outlook.lasting
            case Equal(left, right):
                return left.is_variable or right.is_variable or left == right
            case Not(part=Equal(left, right)):
                return left.is_variable or right.is_variable or left != right
        return False

    def _opened(self, part: Quantified) -> tuple[Formula, ...] | None:
        """What a quantifier says of objects; None where nothing exists that must."""
        own = domains_of(part.variables, self.outlook.members)
        if part.quantifier == "forall":
            values = islice(
                product(*(sorted(own[v.name]) for v in part.variables)), _INSTANCES_LIMIT
            )
            names = [variable.name for variable in part.variables]
            return tuple(renamed(part.part, dict(zip(names, row, strict=True))) for row in values)
        if not all(own.values()):
            return None
        number = self._numbers.setdefault(part, len(self._numbers))
        fresh = {variable.name: f"{variable.name}~{number}" for variable in part.variables}
        for variable in part.variables:
            self.domains[fresh[variable.name]] = own[variable.name]
            self.types[fresh[variable.name]] = types_or_root(variable.types)
        return (renamed(part.part, fresh),)
