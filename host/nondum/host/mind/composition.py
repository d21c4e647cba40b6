"""What the host is made of at one revision, as planning sees it: a function of the snapshot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.peer import PeerComponent
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.component_plugins import ComponentPlugins
from nondum.planning.merge.contribution import Contribution, object_name
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.merge import merge
from nondum.planning.pddl.facts import fact
from nondum.planning.words.phrases import Phrasebook, phrasebook
from nondum.sdk.description import ACTUATORS, PluginDescription
from nondum.sdk.frozen import frozen


@frozen
class Composition:
    """One revision of the catalogue, merged."""

    snapshot: Snapshot
    contributions: tuple[Contribution, ...]
    merged: Merged
    book: Phrasebook
    exclusive: frozenset[str]
    """Units that move the body or say that they serve one user."""
    observed: frozenset[str]
    """Predicates that conditions keep true or false."""

    @property
    def host(self) -> str:
        """The host's name."""
        return self.snapshot.host

    @property
    def revision(self) -> int:
        """The catalogue's revision."""
        return self.snapshot.revision

    @property
    def objects(self) -> frozenset[str]:
        """Everything that facts may be about."""
        return frozenset(self.merged.objects)

    def seeds(self) -> Mapping[str, frozenset[str]]:
        """Component → what its problem fragments say, parked facts included."""
        found: dict[str, set[str]] = {c.component: set() for c in self.contributions}
        for table in (self.merged.init, self.merged.parked):
            for text, origins in table.items():
                for origin in origins:
                    found.setdefault(origin.component, set()).add(text)
        return {component: frozenset(facts) for component, facts in found.items() if component}


def compose(
    snapshot: Snapshot, contributions: tuple[Contribution, ...] | None = None
) -> Composition:
    """Merge a snapshot. Takes some ten milliseconds for a dozen components.

    `contributions` are what its components' hooks say, if they were asked already.
    """
    if contributions is None:
        plugins = ComponentPlugins()
        plugins.see(snapshot)
        contributions = plugins.contributions()
    merged = merge(contributions, snapshot.host)
    return Composition(
        snapshot,
        contributions,
        merged,
        phrasebook(contributions, merged),
        exclusive=frozenset(_exclusive(snapshot, merged)),
        observed=frozenset(
            predicate
            for _, component in snapshot.everyone()
            for condition in component.description.conditions
            for predicate in condition.predicates
        ),
    )


def _exclusive(snapshot: Snapshot, merged: Merged) -> Iterator[str]:
    types = merged.domain.types
    for host, component in snapshot.everyone():
        for unit in component.description.units:
            name = object_name(host, component.id, unit.name)
            found = merged.objects.get(name)
            if unit.users == 1 or (found and types.is_one_of(found.types, tuple(ACTUATORS))):
                yield name


def body_facts(snapshot: Snapshot) -> dict[str, str]:
    """What the host itself asserts, each with the reason in words.

    A unit is idle and a slot free unless a running behaviour takes it; slots that are always
    produced are never free.
    """
    facts = {fact("self", snapshot.host): "this is the host that plans"}
    for host, component in snapshot.everyone():
        facts |= component_facts(
            host, component.id, component.description, is_ready=component.is_ready
        )
    return facts


def component_facts(
    host: str, component: str, description: PluginDescription, *, is_ready: bool
) -> dict[str, str]:
    """What the host asserts of one component that is plugged in, each with the reason in words."""
    facts: dict[str, str] = {}
    for unit in description.units:
        name = object_name(host, component, unit.name)
        facts[fact("on", name, host)] = f"{component} is plugged into {host}"
        if is_ready:
            facts[fact("ready", name)] = f"{component} is healthy and its devices are there"
            facts[fact("idle", name)] = "nothing uses it"
        for output in unit.outputs:
            stream = object_name(host, component, output.name)
            facts[fact("output", name, stream)] = f"{component} declares it"
            if output.always:
                why = f"{component} produces it from its start on"
                facts[fact("from", stream, host)] = why
            else:
                facts[fact("free", stream)] = "nothing uses it"
    return facts


def own_objects(host: str, component: ComponentRecord | PeerComponent) -> dict[str, str]:
    """Local name → object: a component's units and slots."""
    names = [unit.name for unit in component.description.units]
    names += [output.name for unit in component.description.units for output in unit.outputs]
    return {name: object_name(host, component.id, name) for name in names}


def always_produced(snapshot: Snapshot) -> frozenset[str]:
    """The streams that are produced from their worker's start on."""
    return frozenset(
        object_name(host, component.id, output.name)
        for host, component in snapshot.everyone()
        for unit in component.description.units
        for output in unit.outputs
        if output.always
    )
