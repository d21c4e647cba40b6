"""What this host calls the components and plugins of a payload, by all that the state knows. Pure.

Components are named once they are verified, since workers are started by these names; plugins as
their components are entered, since only then is known what everyone else says. Another name than a
component's own stays its payload's, also while that is away: nothing else can be meant by it. Its
own is free while it is away, as its place on the host is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.planning.merge import given_names
from nondum.planning.merge.given_names import NO_NAMES, GivenNames, Words, words_of
from nondum.sdk.description import PluginDescription

_HOLDS_NOTHING = frozenset({Step.RECEIVED, Step.COPIED, Step.REFUSED, Step.GONE})


def named(state: HostState, payload: PayloadRecord, ids: Iterable[str]) -> PayloadRecord:
    """A payload with the names of its components, of their ids in its manifest.

    Releases of one payload call a component the same, whether one was active or not.
    """
    kept: dict[str, str] = {}
    taken: set[str] = set()
    for payload_id, given in state.names.items():
        if payload_id != payload.payload_id:
            taken.update(given.components.values())
    for other in state.payloads.values():
        if other.step in _HOLDS_NOTHING or other.key == payload.key:
            continue
        if other.payload_id == payload.payload_id:
            kept |= other.names
        else:
            taken.update(other.components)
    kept |= state.names.get(payload.payload_id, NO_NAMES).components
    names = given_names.of_components(payload.payload_id, ids, kept, taken)
    renamed = {id: name for id, name in names.items() if id != name}
    return replace(payload, components=tuple(names.values()), renamed=renamed)


def as_called(
    state: HostState, payload_id: str, said: Mapping[str, PluginDescription]
) -> dict[str, PluginDescription]:
    """What the plugins of a payload's components say, each under its name on this host."""
    kept = state.names.get(payload_id, NO_NAMES).plugins
    others: dict[str, set[Words]] = {}
    for other in state.components.values():
        if other.payload_id != payload_id:
            others.setdefault(other.description.name, set()).add(words_of(other.description))
    given = given_names.plugins_of_other_payloads(state.names, payload_id)
    called = {}
    for own in {description.name for description in said.values()}:
        words = {words_of(one) for one in said.values() if one.name == own}
        called[own] = given_names.of_plugin(own, payload_id, words, kept.get(own), others, given)
    return {component: replace(one, name=called[one.name]) for component, one in said.items()}


def remembering(
    state: HostState, payload: PayloadRecord, components: Iterable[ComponentRecord]
) -> dict[str, GivenNames]:
    """All given names that are kept, now that a payload is active with its components."""
    before = state.names.get(payload.payload_id, NO_NAMES)
    plugins = {c.distribution: c.description.name for c in components}
    now = GivenNames(
        _renamed({**before.components, **payload.names}), _renamed({**before.plugins, **plugins})
    )
    if now == NO_NAMES:
        return {id: one for id, one in state.names.items() if id != payload.payload_id}
    return {**state.names, payload.payload_id: now}


def _renamed(names: Mapping[str, str]) -> dict[str, str]:
    return {own: name for own, name in names.items() if name != own}
