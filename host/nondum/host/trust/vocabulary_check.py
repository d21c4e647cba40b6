"""Whether a payload's planning knowledge stands by itself, and speaks words that strangers share.

What `nondum payload check` asks beyond the payload's own form: its fragments are merged with
nothing but the core vocabulary, as they would be on a host that has nothing else.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator, Mapping

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.core import core_graph, core_predicates
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.inventory import kind_problems
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import phrasebook
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

HOST = "host"
"""Any host: names of hosts mean nothing to a fragment."""


@frozen
class Judged:
    """What merging a payload alone shows."""

    problems: tuple[Problem, ...]
    """Why a host would keep its components out of the plan, phrases that no one could say, and
    inputs that no stream could fit."""
    warnings: tuple[Problem, ...]


def judge(index: Mapping[str, PluginDescription]) -> Judged:
    """Merge what a payload's components say with the core vocabulary only."""
    contributions = [
        Contribution.from_description(description, host=HOST, component=component)
        for component, description in index.items()
    ]
    merged = merge(contributions, HOST)
    kept_out = (problem for found in merged.quarantined.values() for problem in found)
    unsaid = phrasebook(contributions, merged).problems
    return Judged(
        (*kept_out, *unsaid, *_wrong_slots(index, merged)), (*merged.warnings, *_own_words(merged))
    )


def _wrong_slots(index: Mapping[str, PluginDescription], merged: Merged) -> Iterator[Problem]:
    """Optional inputs, and what outputs are of, whose types no fragment declares. No plan asks for
    them, so planning would not miss them: the input would be left without a stream, unseen."""
    graph = merged.domain.types
    for component, description in index.items():
        if component in merged.quarantined:  # its own types are not known then
            continue
        for unit in description.units:
            for slot in unit.inputs:
                where = f"{component} input {f'{unit.name}.{slot.name}'!r}"
                yield from kind_problems(slot.type, "stream", where, graph)
            read = [(slot.name, slot.of) for slot in unit.inputs]
            sent = [(slot.name, slot.of) for slot in unit.outputs]
            for name, of in read + sent:
                where = f"{component} `of` of {f'{unit.name}.{name}'!r}"
                yield from kind_problems(of, "unit", where, graph) if of else ()


def _own_words(merged: Merged) -> Iterator[Problem]:
    """Types and predicates that only this payload knows: no other payload can plan with them."""
    types = core_graph().parents.keys()
    own_types = {name for name in merged.domain.type_origins if name not in types}
    predicates = core_predicates()
    own_predicates = merged.domain.predicates.keys() - predicates.keys()
    yield from _warned("type", own_types, types)
    yield from _warned("predicate", own_predicates, predicates.keys())


def _warned(kind: str, own: Collection[str], core: Collection[str]) -> Iterator[Problem]:
    for name in sorted(own):
        near = difflib.get_close_matches(name, core, n=1)
        yield Problem(
            "PDDL_OWN_WORD",
            f"{kind} {name!r} is in no other fragment that is known here",
            where=name,
            fix=f"the nearest word of nondum-core is {near[0]!r}"
            if near
            else "keep it if no word of nondum-core means the same",
        )
