"""Which payloads a goal can have to do with at all, before anything is merged.

Backwards from the goal: whatever gives what is asked for asks for its own conditions, whichever
payload brings it. Words are compared by name, without arguments: what is left out cannot help, what
is kept may.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TypeAlias

from nondum.planning.explain.advise.candidate import Candidate
from nondum.planning.merge.claims import claims_of
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.core import core_graph
from nondum.planning.merge.domain import Action, DerivedRule
from nondum.planning.pddl.facts import predicate_of
from nondum.planning.pddl.normal import Condition, atoms_in
from nondum.planning.pddl.syntax import And, Formula, Not, Or, Quantified, TypedName, terms_of
from nondum.planning.pddl.typegraph import TypeGraph, types_or_root
from nondum.sdk.frozen import frozen

SignedPredicate: TypeAlias = tuple[str, bool]
"""A predicate, and whether facts of it are to be true."""


@frozen
class Schema:
    """An action or rule, as far as relevance goes."""

    gives: frozenset[SignedPredicate]
    asks: frozenset[SignedPredicate]
    types: frozenset[str]
    """Whatever else it acts upon must be of these."""


@frozen
class Sketch:
    """What one component brings, by name."""

    schemas: tuple[Schema, ...]
    facts: frozenset[str]
    """The predicates of which it says facts."""
    objects: tuple[tuple[str, tuple[str, ...]], ...]
    """Everything that exists with it, and its types."""
    parents: tuple[tuple[str, frozenset[str]], ...]


@lru_cache(maxsize=4096)
def sketch_of(contribution: Contribution) -> Sketch:
    """Sketch a component; one whose fragments are wrong brings its objects only."""
    claims = claims_of(contribution)
    owned = [(unit.object, (unit.type,)) for unit in contribution.units]
    owned += [(stream.object, (stream.type,)) for stream in contribution.streams]
    return Sketch(
        (*map(_of_action, claims.actions), *map(_of_rule, claims.derived)),
        frozenset(predicate_of(claim.fact) for claim in claims.facts),
        (*owned, *((claim.name, claim.types) for claim in claims.objects)),
        tuple((claim.name, claim.parents) for claim in claims.types),
    )


def relevant(
    present: Iterable[Contribution], goal: Condition, candidates: Sequence[Candidate]
) -> tuple[Candidate, ...]:
    """The candidates that may help towards a goal, in the order given."""
    sketches = [[sketch_of(c) for c in candidate.contributions] for candidate in candidates]
    here = [sketch_of(contribution) for contribution in present]
    everyone = [*here, *(sketch for group in sketches for sketch in group)]
    wishes, types = _closure(goal, everyone)
    asked = {predicate for predicate, _ in wishes}
    named = {term.name for part in goal.parts() for term in terms_of(part)}
    graph = _graph(everyone)
    return tuple(
        candidate
        for candidate, group in zip(candidates, sketches, strict=True)
        if any(_may_help(sketch, wishes, asked, types, named, graph) for sketch in group)
    )


def _closure(goal: Condition, sketches: Iterable[Sketch]) -> tuple[set[SignedPredicate], set[str]]:
    givers: defaultdict[SignedPredicate, list[Schema]] = defaultdict(list)
    for sketch in sketches:
        for schema in sketch.schemas:
            for wish in schema.gives:
                givers[wish].append(schema)
    waiting = list(_wishes(goal))
    wishes = set(waiting)
    types = _quantified_types(goal)
    while waiting:
        for schema in givers.pop(waiting.pop(), ()):
            new = schema.asks - wishes
            wishes |= new
            waiting += new
            types |= schema.types
    return wishes, types


def _may_help(
    sketch: Sketch,
    wishes: set[SignedPredicate],
    asked: set[str],
    types: set[str],
    named: set[str],
    graph: TypeGraph,
) -> bool:
    if any(not schema.gives.isdisjoint(wishes) for schema in sketch.schemas):
        return True
    if not sketch.facts.isdisjoint(asked):
        return True
    return any(name in named or graph.is_one_of(of, types) for name, of in sketch.objects)


def _graph(sketches: Iterable[Sketch]) -> TypeGraph:
    """Every claim of a parent at once, even of claims that contradict each other."""
    parents: defaultdict[str, frozenset[str]] = defaultdict(frozenset, core_graph().parents)
    for sketch in sketches:
        for name, claimed in sketch.parents:
            parents[name] |= claimed
    return TypeGraph(dict(parents))


def _of_action(action: Action) -> Schema:
    """The actor is a unit of the same plugin: no other component can play it."""
    gives = {(atom.predicate, True) for atom in action.effect.added()}
    gives |= {(atom.predicate, False) for atom in action.effect.deleted()}
    asks = set(_wishes(action.precondition))
    types = _types(action.parameters[1:]) | _quantified_types(action.precondition)
    for change in action.effect.conditional:
        either = {predicate for predicate, _ in _wishes(change.condition)}
        asks |= {(predicate, is_true) for predicate in either for is_true in (True, False)}
        types |= _types(change.variables) | _quantified_types(change.condition)
    return Schema(frozenset(gives), frozenset(asks), frozenset(types))


def _of_rule(rule: DerivedRule) -> Schema:
    """What keeps it from holding is asked for as well, for somebody may need it false."""
    gives = frozenset((rule.head.predicate, is_true) for is_true in (True, False))
    asks = {(p, is_true) for p, _ in _wishes(rule.condition) for is_true in (True, False)}
    types = _types(rule.parameters) | _quantified_types(rule.condition)
    return Schema(gives, frozenset(asks), frozenset(types))


def _wishes(condition: Condition) -> Iterator[SignedPredicate]:
    for part in condition.parts():
        for atom, is_positive in atoms_in(part):
            yield atom.predicate, is_positive


def _types(variables: Iterable[TypedName]) -> set[str]:
    return {type_ for variable in variables for type_ in types_or_root(variable.types)}


def _quantified_types(condition: Condition) -> set[str]:
    return _types(v for part in condition.further for v in quantified_in(part))


def quantified_in(formula: Formula) -> Iterator[TypedName]:
    """The variables that a normal condition quantifies over."""
    match formula:
        case And() | Or():
            for part in formula.parts:
                yield from quantified_in(part)
        case Not():
            yield from quantified_in(formula.part)
        case Quantified():
            yield from formula.variables
            yield from quantified_in(formula.part)
