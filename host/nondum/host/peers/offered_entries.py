"""What this host offers its peers: the entries of its catalogue that they are told. Pure.

    component/ID    version, payload, readiness, rank, description, units that are withheld
    mount/UNIT      where a unit sits on this host's body
    device/ID       the component that has a device
    compute         what this host has to compute with
    reach           the addresses at which its streams can be fetched, where no link tells them
    fact/ID/FACT    what a component says is so: predicate, arguments, value
    flow/STREAM     the component on whose stream messages arrive
    taken/FACT      the host that uses what the fact is about

Of a component whose units are withheld the words are shared all the same: what it says in PDDL, its
phrases and labels. So peers understand what they cannot do, and know who can.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

from nondum.host.core.events.facts import FactKnown, StreamFlowing
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.composition import Composition, own_objects
from nondum.planning.merge.scope import SELF
from nondum.planning.pddl.facts import fact
from nondum.sdk.description import ACTUATORS, PluginDescription
from nondum.sdk.frozen import frozen

Entries: TypeAlias = dict[str, dict[str, Any]]
Claim: TypeAlias = FactKnown | StreamFlowing


@frozen
class Offer:
    """A component as peers may have it."""

    description: PluginDescription
    withheld: tuple[str, ...]
    """Its units that they may not use."""

    def brings(self, behaviour: str) -> bool:
        """Whether they may ask for a behaviour."""
        return any(found.name == behaviour for found in self.description.behaviours)


@frozen
class Policy:
    """What the integrator allows."""

    movable: frozenset[str] = frozenset()
    """Components whose actuators peers may use."""
    actuators: frozenset[str] = ACTUATORS
    """Unit types that move the body, with all their subtypes."""

    def offer(self, component: ComponentRecord) -> Offer:
        """What of a component is offered."""
        described = component.description
        withheld = {unit.name for unit in described.units if unit.type in self.actuators}
        if component.id in self.movable or not withheld:
            return Offer(described, ())
        units = tuple(unit for unit in described.units if unit.name not in withheld)
        return Offer(replace(described, units=units, devices=()), tuple(sorted(withheld)))


def policy_of(composition: Composition | None, movable: frozenset[str]) -> Policy:
    """The policy with all types of actuators that are known now."""
    if composition is None:
        return Policy(movable)
    types = composition.merged.domain.types
    moving = (name for name in types.parents if types.is_one_of((name,), ACTUATORS))
    return Policy(movable, ACTUATORS | frozenset(moving))


def catalogue_entries(snapshot: Snapshot, policy: Policy) -> Entries:
    """The entries that change with the catalogue only."""
    entries: Entries = {}
    shared: set[str] = set()
    for component in snapshot.components:
        offer = policy.offer(component)
        shared |= objects_of(snapshot.host, component, offer)
        entries[f"component/{component.id}"] = {
            "payload": component.payload_id,
            "version": component.version,
            "ready": component.is_ready,
            "rank": component.rank,
            "withheld": list(offer.withheld),
            "description": offer.description.to_dict(),
        }
        entries |= {
            f"device/{claim.device}": {"component": component.id}
            for claim in component.devices
            if claim.device is not None
        }
    for mount in snapshot.mounts:
        if mount.unit in shared:
            entries[f"mount/{mount.unit}"] = {"xyz": list(mount.xyz), "rpy": list(mount.rpy)}
    return entries


def passing(
    snapshot: Snapshot,
    policy: Policy,
    claims: Callable[[str], Iterable[Claim]],
    taken: Mapping[str, str],
) -> Entries:
    """The entries that change with the world: what each component says is so, and which facts do
    not hold since somebody uses what they are about."""
    entries: Entries = {f"taken/{text}": {"by": user} for text, user in taken.items()}
    for component in snapshot.components:
        names = {SELF: snapshot.host, **own_objects(snapshot.host, component)}
        shared = objects_of(snapshot.host, component, policy.offer(component))
        entries |= _claimed(component.id, claims(component.id), names, shared)
    return entries


def changes(before: Entries, after: Entries) -> dict[str, dict[str, Any] | None]:
    """What leads from one set of entries to another.

    >>> changes({"a": {"n": 1}, "b": {}}, {"a": {"n": 2}})
    {'a': {'n': 2}, 'b': None}
    """
    new: dict[str, dict[str, Any] | None] = {
        key: body for key, body in after.items() if before.get(key) != body
    }
    return new | {key: None for key in before if key not in after}


def objects_of(host: str, component: ComponentRecord, offer: Offer) -> set[str]:
    """The units and streams of a component that peers may use."""
    names = own_objects(host, component)
    units = offer.description.units
    return {names[unit.name] for unit in units} | {names[o.name] for u in units for o in u.outputs}


def _claimed(
    component: str, claims: Iterable[Claim], names: Mapping[str, str], shared: Collection[str]
) -> Iterator[tuple[str, dict[str, Any]]]:
    for claim in claims:
        match claim:
            case FactKnown(_, predicate, arguments, value):
                objects = [names.get(argument, argument) for argument in arguments]
                key = f"fact/{component}/{fact(predicate, *objects)}"
                yield key, {"predicate": predicate, "arguments": objects, "value": value}
            case StreamFlowing(_, stream, True) if stream in shared:
                yield f"flow/{stream}", {"component": component}
