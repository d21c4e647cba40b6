"""Whether a release that takes over would say less to planning than the one that it replaces.

Judged from what `index.json` says, so nothing has to be started for it: what is here is merged as
it is, and once more with the new release in the place of the old one. Peers' words do not count: a
fleet is upgraded host by host.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import releases
from nondum.host.trust import vocabulary_check
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import phrasebook
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

Index = Mapping[str, PluginDescription]
"""Component id → what its plugin says."""


def problems(state: HostState, payload: PayloadRecord, index: Index) -> tuple[Problem, ...]:
    """Why a release must not replace another one that is here; empty: it may, or there is none.

    Of one that waits, only the name is known: then the new release has to be sound by itself.
    """
    old = releases.active_release(state, payload)
    if old is not None:
        return _losses(state, old, index)
    if any(other.step is Step.SUPERSEDED for other in releases.other_releases(state, payload)):
        return vocabulary_check.judge(index).problems
    return ()


def _losses(state: HostState, old: PayloadRecord, index: Index) -> tuple[Problem, ...]:
    own = state.components.values()
    others = [_contribution(state, c.id, c.description) for c in own if c.payload != old.key]
    replaced = (_contribution(state, c.id, c.description) for c in own if c.payload == old.key)
    replacing = (_contribution(state, id, description) for id, description in index.items())
    before = _Found.in_merge((*others, *replaced), state.host)
    after = _Found.in_merge((*others, *replacing), state.host)
    kept_out = (after.kept_out[id] for id in sorted(after.kept_out.keys() - before.kept_out.keys()))
    said_wrongly = (problem for problem in after.phrases if problem not in before.phrases)
    return (*(problem for found in kept_out for problem in found), *said_wrongly)


@frozen
class _Found:
    """What is wrong in one merge."""

    kept_out: Mapping[str, tuple[Problem, ...]]
    """Component → why it is kept out of planning."""
    phrases: tuple[Problem, ...]

    @classmethod
    def in_merge(cls, contributions: Iterable[Contribution], host: str) -> _Found:
        together = tuple(contributions)
        merged = merge(together, host)
        return cls(merged.quarantined, phrasebook(together, merged).problems)


def _contribution(state: HostState, id: str, description: PluginDescription) -> Contribution:
    """What a component brings, with the rank that it has or would be given: after all others."""
    known = state.components.get(id)
    last = max((c.rank for c in state.components.values()), default=0) + 1
    rank = known.rank if known is not None else last
    return Contribution.from_description(description, host=state.host, component=id, rank=rank)
