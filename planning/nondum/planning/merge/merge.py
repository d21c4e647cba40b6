"""Strangers' fragments into one domain: a pure function of the set of contributions.

Each contribution is first checked by itself (`claims`), then let in or kept out in the order of
precedence (`admission`). Removing one and merging again is exact, since nothing is remembered.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

from nondum.planning.merge.admission import Agreement
from nondum.planning.merge.claims import Claims, claims_of
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Action, Domain, Merged, Object, Origin
from nondum.planning.merge.scope import Report, TooManyProblems
from nondum.planning.pddl.facts import parts
from nondum.planning.pddl.typegraph import TypeGraph
from nondum.sdk.errors import Problem


def merge(contributions: Iterable[Contribution], self_host: str) -> Merged:
    """Merge all contributions; `self_host` is the host that plans.

    A component whose fragments are wrong, or contradict those of one that precedes it, is left out
    whole and named in `quarantined`. Raises `ValueError` when two contributions speak for one
    component.
    """
    ordered = sorted(set(contributions), key=lambda c: (c.rank, c.component, c.host))
    _refuse_doubles(ordered)
    agreement = Agreement.of_core(sorted({self_host, *(c.host for c in ordered)}))
    admitted: list[Claims] = []
    quarantined: dict[str, tuple[Problem, ...]] = {}
    warnings: list[Problem] = []
    for contribution in ordered:
        claims = claims_of(contribution)
        report = _report(contribution)
        report.problems.extend(claims.problems)
        wider = agreement if claims.problems else _joined(agreement, claims, report)
        if report.problems:
            quarantined[contribution.component] = tuple(report.problems)
            continue
        agreement = wider
        admitted.append(claims)
        warnings += (*claims.warnings, *report.warnings)
    return _merged(agreement, admitted, quarantined, tuple(warnings), self_host)


def _joined(agreement: Agreement, claims: Claims, report: Report) -> Agreement:
    try:
        return agreement.joined_by(claims, report)
    except TooManyProblems:
        return agreement


def _refuse_doubles(ordered: Sequence[Contribution]) -> None:
    for first, second in pairwise(ordered):
        if (first.host, first.component) == (second.host, second.component):
            raise ValueError(f"two contributions of {second.component} on {second.host}")


def _report(contribution: Contribution) -> Report:
    by = Origin(contribution.component, contribution.plugin, contribution.version)
    return Report(by, {fragment.name: fragment.text for fragment in contribution.fragments})


def _merged(
    agreement: Agreement,
    admitted: Sequence[Claims],
    quarantined: dict[str, tuple[Problem, ...]],
    warnings: tuple[Problem, ...],
    self_host: str,
) -> Merged:
    contributions = [claims.contribution for claims in admitted]
    graph = TypeGraph(agreement.parents)
    unit_types = {(c.plugin, unit.type) for c in contributions for unit in c.units}
    actions = {
        name: _narrowed(
            action, sorted(t for plugin, t in unit_types if plugin == action.plugin), graph
        )
        for name, action in sorted(agreement.actions.items())
    }
    actor_types = {t for action in actions.values() for t in action.parameters[0].types}
    narrowed = actor_types | {_of_plugin(plugin, type_) for plugin, type_ in unit_types}
    types = graph.with_parents({name: frozenset({_widened(name)}) for name in sorted(narrowed)})
    objects = {**agreement.objects, **_owned(contributions)}
    init, parked = _facts(admitted, objects)
    return Merged(
        domain=Domain(
            types=types,
            type_origins=dict(sorted(agreement.type_origins.items())),
            predicates=dict(sorted(agreement.predicates.items())),
            actions=actions,
            derived=agreement.derived,
            functions=dict(sorted(agreement.functions.items())),
        ),
        objects=dict(sorted(objects.items())),
        init=init,
        self_host=self_host,
        parked=parked,
        values=_values(admitted),
        quarantined=dict(sorted(quarantined.items())),
        warnings=warnings,
    )


def _of_plugin(plugin: str, type_: str) -> str:
    """The type of one plugin's units of a type; no fragment can write its dot."""
    return f"{plugin}.{type_}"


def _widened(narrow: str) -> str:
    return narrow.rpartition(".")[2]


def _narrowed(action: Action, unit_types: Sequence[str], graph: TypeGraph) -> Action:
    """The action with its actor limited to its own plugin's units."""
    actor, *others = action.parameters
    fitting = tuple(t for t in unit_types if graph.all_kind_of((t,), actor.types))
    types = tuple(_of_plugin(action.plugin, t) for t in fitting or actor.types)
    return replace(action, parameters=(replace(actor, types=types), *others))


def _owned(contributions: Iterable[Contribution]) -> dict[str, Object]:
    owned = {}
    for c in contributions:
        origins = (Origin(c.component, c.plugin, c.version),)
        for unit in c.units:
            types = (_of_plugin(c.plugin, unit.type),)
            owned[unit.object] = Object(
                unit.object, types, unit.local, c.host, c.component, origins
            )
        for stream in c.streams:
            owned[stream.object] = Object(
                stream.object, (stream.type,), stream.slot, c.host, c.component, origins
            )
    return owned


def _facts(
    admitted: Iterable[Claims], objects: dict[str, Object]
) -> tuple[dict[str, tuple[Origin, ...]], dict[str, tuple[Origin, ...]]]:
    """The facts asserted, and those that wait for an object."""
    asserted: dict[str, tuple[Origin, ...]] = {}
    for claims in admitted:
        for claim in claims.facts:
            asserted[claim.fact] = (*asserted.get(claim.fact, ()), claim.origin)
    init: dict[str, tuple[Origin, ...]] = {}
    parked: dict[str, tuple[Origin, ...]] = {}
    for text, origins in sorted(asserted.items()):
        is_whole = all(argument in objects for argument in parts(text)[1])
        (init if is_whole else parked)[text] = origins
    return init, parked


def _values(admitted: Iterable[Claims]) -> dict[str, int]:
    """What functions give; of two who differ, the one that takes precedence has the say."""
    values: dict[str, int] = {}
    for claims in admitted:
        for claim in claims.values:
            values.setdefault(claim.function, claim.value)
    return dict(sorted(values.items()))
