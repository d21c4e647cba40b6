"""Derived predicates: what holds wherever a condition does, and in which order that is settled."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from nondum.planning.merge.domain import DerivedRule
from nondum.planning.merge.scope import Scope
from nondum.planning.pddl.caret import Misplaced
from nondum.planning.pddl.normal import atoms_in, condition_of
from nondum.planning.pddl.syntax import DerivedDeclaration, DomainFragment, TypedName
from nondum.planning.pddl.typegraph import types_or_root
from nondum.sdk.frozen import frozen


@frozen
class Strata:
    """Derived predicates in groups, each after those that it asks the negation of."""

    groups: tuple[tuple[str, ...], ...] = ()
    circle: tuple[str, ...] = ()
    """Predicates that hold only if they do not, each asking for the next; then there are no groups.
    """


def derived_of(domains: Iterable[DomainFragment], scope: Scope) -> tuple[DerivedRule, ...]:
    """The rules of one component (PDDL_UNKNOWN, PDDL_OWNED, and the codes of conditions)."""
    declared = (rule for domain in domains for rule in domain.derived)
    rules = (_rule(declaration, scope) for declaration in declared)
    return tuple(rule for rule in rules if rule)


def _rule(declared: DerivedDeclaration, scope: Scope) -> DerivedRule | None:
    problems_before = len(scope.report.problems)
    if declared.name in scope.of_host:
        scope.check_writable(declared.head)
        return None
    parameters = typed(declared.parameters)
    variables = {p.name: p.types for p in scope.checked_types(parameters)}
    try:
        condition = condition_of(declared.condition)
    except Misplaced as wrong:
        scope.report.problem(wrong.code, wrong.message, wrong.place, wrong.fix)
        return None
    scope.check_atom(declared.head, variables)
    scope.check_formula(declared.condition, variables)
    if len(scope.report.problems) > problems_before:
        return None
    return DerivedRule(declared.head, parameters, condition, (scope.report.origin(declared.place),))


def typed(parameters: Sequence[TypedName]) -> tuple[TypedName, ...]:
    """Parameters, each with its types; those that claim none are objects."""
    return tuple(TypedName(p.name, types_or_root(p.types), p.place) for p in parameters)


def strata_of(rules: Sequence[DerivedRule]) -> Strata:
    """Group predicates so that each is settled after all that its rules need to be false.

    Source: Apt, Blair and Walker, Towards a Theory of Declarative Knowledge (1988).
    """
    names = {rule.head.predicate for rule in rules}
    level = dict.fromkeys(names, 0)
    edges = [
        (rule.head.predicate, needed, is_positive)
        for rule in rules
        for needed, is_positive in _needs(rule)
        if needed in names
    ]
    raised_by: dict[str, str] = {}
    for _ in range(len(names) + 1):
        raised = ""
        for head, needed, is_positive in edges:
            lowest = level[needed] + (0 if is_positive else 1)
            if level[head] < lowest:
                level[head], raised_by[head], raised = lowest, needed, head
        if not raised:
            break
    else:
        return Strata(circle=_circle(raised_by, raised))
    groups: dict[int, list[str]] = {}
    for name in sorted(names):
        groups.setdefault(level[name], []).append(name)
    return Strata(tuple(tuple(groups[number]) for number in sorted(groups)))


def asked_by(rule: DerivedRule) -> frozenset[str]:
    """The predicates that a rule's condition speaks of."""
    return frozenset(predicate for predicate, _ in _needs(rule))


def _needs(rule: DerivedRule) -> Iterator[tuple[str, bool]]:
    for part in rule.condition.parts():
        for atom, is_positive in atoms_in(part):
            yield atom.predicate, is_positive


def _circle(raised_by: Mapping[str, str], last: str) -> tuple[str, ...]:
    """What raises itself without end, the first by name first."""
    for _ in raised_by:  # the last to rise may only hang on a circle
        last = raised_by[last]
    circle = [last]
    while raised_by[circle[-1]] != last:
        circle.append(raised_by[circle[-1]])
    first = circle.index(min(circle))
    return (*circle[first:], *circle[:first])
