"""Letting components into a merge one by one, each whole or not at all.

Rules M2-M14 of merging: words are shared by plain name; the first component in precedence
decides, and what contradicts it is kept out, with both places named.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from nondum.planning.merge.claims import Claims
from nondum.planning.merge.core import CORE_NAME, CORE_VERSION, core, core_graph, core_predicates
from nondum.planning.merge.derivation import strata_of
from nondum.planning.merge.domain import Action, DerivedRule, Object, Origin, Predicate
from nondum.planning.merge.scope import Report
from nondum.planning.merge.vocabulary import cycle_text
from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.syntax import Place, type_text
from nondum.planning.pddl.typegraph import ROOT, TypeGraph

Types = tuple[str, ...]


@dataclass(slots=True)
class Agreement:
    """What the components that were let in agree upon."""

    parents: dict[str, frozenset[str]] = field(default_factory=dict)
    type_origins: dict[str, tuple[Origin, ...]] = field(default_factory=dict)
    predicates: dict[str, Predicate] = field(default_factory=dict)
    objects: dict[str, Object] = field(default_factory=dict)
    actions: dict[str, Action] = field(default_factory=dict)
    functions: dict[str, Predicate] = field(default_factory=dict)
    derived: tuple[DerivedRule, ...] = ()
    written: dict[str, Origin] = field(default_factory=dict)
    """Predicates that actions or problem fragments write, each with the first who does."""

    @classmethod
    def of_core(cls, hosts: Iterable[str]) -> Agreement:
        """Where every merge begins: the core's words, and the hosts as objects."""
        origins: dict[str, tuple[Origin, ...]] = {
            type_.name: (Origin("", CORE_NAME, CORE_VERSION, type_.place),)
            for type_ in core().types
        }
        return cls(
            parents=dict(core_graph().parents),
            type_origins=origins,
            predicates=dict(core_predicates()),
            objects={host: Object(host, ("host",)) for host in hosts},
        )

    def joined_by(self, claims: Claims, report: Report) -> Agreement:
        """The agreement with one component more; whatever contradicts goes to the report, and then
        the answer means nothing."""
        wider = Agreement(
            dict(self.parents),
            dict(self.type_origins),
            dict(self.predicates),
            dict(self.objects),
            dict(self.actions),
            dict(self.functions),
            self.derived,
            dict(self.written),
        )
        _join_types(wider, claims, report)
        if not report.problems:
            graph = TypeGraph(wider.parents)
            _join_signatures(wider.predicates, "predicate", claims.predicates, graph, report)
            _join_signatures(wider.functions, "function", claims.functions, graph, report)
            _join_objects(wider, claims, graph, report)
            _join_actions(wider, claims, report)
            _join_derived(wider, claims, report)
        return wider


def _join_types(agreed: Agreement, claims: Claims, report: Report) -> None:
    if not claims.types:
        return
    both = dict(agreed.parents)
    for claim in claims.types:
        both[claim.name] = both.get(claim.name, frozenset()) | claim.parents
    graph = TypeGraph(both)
    cycle = graph.cycle(claim.name for claim in claims.types)
    if cycle:
        named = [claim for claim in claims.types if claim.name in cycle]
        others = _places(o for name in cycle for o in agreed.type_origins.get(name, ()))
        message = f"types in a circle: {cycle_text(cycle)}, together with {others}"
        report.problem("PDDL_TYPE_CYCLE", message, _place(named[0].origin))
        return
    for claim in claims.types:
        known = agreed.parents.get(claim.name, frozenset())
        if _says_no_less(graph, claim.parents, known):
            agreed.parents[claim.name] = claim.parents
        elif not _says_no_less(graph, known, claim.parents):
            others = _places(agreed.type_origins[claim.name])
            message = (
                f"type {claim.name!r} is a kind of {type_text(tuple(sorted(claim.parents)))} here,"
                f" of {type_text(tuple(sorted(known)))} in {others}"
            )
            report.problem("PDDL_TYPE_PARENT", message, _place(claim.origin), "choose another name")
        origins = agreed.type_origins.get(claim.name, ())
        agreed.type_origins[claim.name] = (*origins, claim.origin)


def _says_no_less(graph: TypeGraph, parents: frozenset[str], known: frozenset[str]) -> bool:
    """Whether being a kind of all `parents` includes being a kind of all `known`."""
    above = frozenset(a for parent in parents for a in graph.ancestors(parent)) | {ROOT}
    return known <= above


def _join_signatures(
    agreed: dict[str, Predicate],
    kind: str,
    claims: Iterable[Predicate],
    graph: TypeGraph,
    report: Report,
) -> None:
    for claim in claims:
        known = agreed.get(claim.name)
        if known is None:
            agreed[claim.name] = claim
            continue
        if known.arity != claim.arity:
            message = (
                f"{kind} {claim.name!r}: {claim.arity} arguments here,"
                f" {known.arity} in {_places(known.origins)}"
            )
            report.problem("PDDL_ARITY", message, _place(claim.origins[0]), "choose another name")
            continue
        agreed[claim.name] = replace(
            known,
            parameters=_wider(known, claim, kind, graph, report),
            valued=known.valued or claim.valued,
            value_type=_value_type(known, claim, kind, report),
            functional=known.functional or claim.functional,
            origins=known.origins + claim.origins,
        )


def _value_type(known: Predicate, claim: Predicate, kind: str, report: Report) -> str:
    """The type of message that both say the value is (PDDL_SIGNATURE); who says none agrees."""
    if known.value_type and claim.value_type and known.value_type != claim.value_type:
        message = (
            f"{kind} {claim.name!r}: its value is a {claim.value_type} here,"
            f" a {known.value_type} in {_places(known.origins)}"
        )
        report.problem("PDDL_SIGNATURE", message, _place(claim.origins[0]), "choose another name")
    return known.value_type or claim.value_type


def _wider(
    known: Predicate, claim: Predicate, kind: str, graph: TypeGraph, report: Report
) -> tuple[Types, ...]:
    wider = []
    pairs = zip(known.parameters, claim.parameters, strict=True)
    for position, (theirs, mine) in enumerate(pairs, 1):
        difference = (
            f"{kind} {claim.name!r}, argument {position}: {type_text(mine)} here,"
            f" {type_text(theirs)} in {_places(known.origins)}"
        )
        place = _place(claim.origins[0])
        if not graph.comparable(mine, theirs):
            report.problem("PDDL_SIGNATURE", difference, place, "choose another name")
        elif set(mine) != set(theirs):
            report.warning("PDDL_SIGNATURE", f"{difference}; taken as the wider one", place)
        wider.append(theirs if graph.all_kind_of(mine, theirs) else mine)
    return tuple(wider)


def _join_objects(agreed: Agreement, claims: Claims, graph: TypeGraph, report: Report) -> None:
    for claim in claims.objects:
        known = agreed.objects.get(claim.name)
        if known is None:
            agreed.objects[claim.name] = Object(claim.name, claim.types, origins=(claim.origin,))
            continue
        if not graph.comparable(claim.types, known.types):
            message = (
                f"{claim.name!r} is {type_text(claim.types)} here,"
                f" {type_text(known.types)} in {_places(known.origins) or 'this robot'}"
            )
            report.problem("PDDL_OBJECT_TYPE", message, _place(claim.origin), "choose another name")
            continue
        is_closer = graph.all_kind_of(claim.types, known.types)
        agreed.objects[claim.name] = replace(
            known,
            types=claim.types if is_closer else known.types,
            origins=(*known.origins, claim.origin),
        )


def _join_actions(agreed: Agreement, claims: Claims, report: Report) -> None:
    for action in claims.actions:
        known = agreed.actions.setdefault(action.name, action)
        if known is action:
            continue
        if known != action:
            message = f"action {action.name!r} differs from the one in {_places(known.origins)}"
            fix = "run one version of the plugin on this host"
            report.problem("PDDL_VERSION", message, _place(action.origins[0]), fix)
            continue
        agreed.actions[action.name] = replace(known, origins=known.origins + action.origins)


def _join_derived(agreed: Agreement, claims: Claims, report: Report) -> None:
    """Derived predicates are written by rules alone, of whichever component."""
    written = dict(_written(claims))
    agreed.written |= {name: by for name, by in written.items() if name not in agreed.written}
    agreed.derived += claims.derived
    mine = {rule.head.predicate: rule.origins[0] for rule in claims.derived}
    theirs = {rule.head.predicate: rule.origins[0] for rule in reversed(agreed.derived)}
    for name in sorted(mine.keys() & agreed.written.keys()):
        _refuse_written(name, mine[name], agreed.written[name], report)
    for name in sorted(written.keys() & theirs.keys() - mine.keys()):
        _refuse_written(name, written[name], theirs[name], report)
    if claims.derived and (circle := strata_of(agreed.derived).circle):
        message = f"these hold only if they do not: {', '.join(circle)}"
        fix = "take a negation out of the circle"
        origin = next(r.origins[0] for r in claims.derived if r.head.predicate in circle)
        report.problem("PDDL_DERIVED", message, _place(origin), fix)


def _refuse_written(name: str, mine: Origin, other: Origin, report: Report) -> None:
    message = f"{name!r} follows from rules in one place and is written in another: {other}"
    fix = "use another predicate for what is written"
    report.problem("PDDL_DERIVED", message, _place(mine), fix)


def _written(claims: Claims) -> Iterator[tuple[str, Origin]]:
    """Every predicate that one component's actions and facts write."""
    for claim in claims.facts:
        yield parts(claim.fact)[0], claim.origin
    for action in claims.actions:
        for atom in (*action.effect.added(), *action.effect.deleted()):
            yield atom.predicate, action.origins[0]


def _place(origin: Origin) -> Place:
    assert origin.place is not None, "what fragments claim has a place"
    return origin.place


def _places(origins: Iterable[Origin]) -> str:
    return " and ".join(map(str, origins))
