"""What one component brings to planning: fragments, and the objects that it owns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from nondum.planning.pddl.facts import fact
from nondum.sdk.description import (
    Behaviour,
    Fragment,
    Label,
    Phrase,
    PluginDescription,
    Unit,
)
from nondum.sdk.frozen import frozen


def object_name(host: str, component: str, local: str) -> str:
    """The planning object of a unit or an output slot; the same on every host.

    >>> object_name("rover", "front-eye", "camera")
    'rover__front-eye__camera'
    >>> object_name("mule", "front-eye@mule", "camera")
    'mule__front-eye__camera'
    """
    return f"{host}__{id_at_home(component)}__{local}"


def peers_id(component: str, host: str) -> str:
    """What a component of a peer is called here, where its id may be another's."""
    return f"{component}@{host}"


def id_at_home(component: str) -> str:
    """What a component is called on its own host."""
    return component.partition("@")[0]


@frozen
class UnitObject:
    """A unit as an object of planning."""

    local: str
    """The name that the plugin's own fragments use."""
    object: str
    type: str


@frozen
class StreamObject:
    """An output slot as an object of planning."""

    slot: str
    """The name that the plugin's own fragments use."""
    object: str
    type: str
    unit: str
    """The object of the unit that it belongs to."""


@frozen
class Contribution:
    """One component's part in planning. Equal contributions merge equally, whenever they came."""

    component: str
    """Its id here: a peer's has its host behind it."""
    host: str
    plugin: str
    """The distribution's normalised name; its actions become `plugin.action`."""
    version: str
    rank: int = 0
    """Precedence when two contradict each other: the smaller wins, then the component's name."""
    fragments: tuple[Fragment, ...] = ()
    units: tuple[UnitObject, ...] = ()
    streams: tuple[StreamObject, ...] = ()
    behaviours: tuple[Behaviour, ...] | None = None
    """What carries the actions out; None where only the PDDL is known."""
    phrases: tuple[Phrase, ...] = ()
    labels: tuple[Label, ...] = ()

    @classmethod
    def from_description(
        cls, description: PluginDescription, *, host: str, component: str, rank: int = 0
    ) -> Contribution:
        """What a plugin brings when `component` on `host` runs it."""
        return cls.of(
            host=host,
            component=component,
            rank=rank,
            describe={"name": description.name, "version": description.version},
            fragments=description.fragments,
            units=description.units,
            behaviours=description.behaviours,
            phrases=description.phrases,
            labels=description.labels,
        )

    @classmethod
    def of(
        cls,
        *,
        host: str,
        component: str,
        rank: int,
        describe: Mapping[str, str],
        fragments: tuple[Fragment, ...],
        units: tuple[Unit, ...],
        behaviours: tuple[Behaviour, ...],
        phrases: tuple[Phrase, ...],
        labels: tuple[Label, ...],
    ) -> Contribution:
        """The same from what the describing hooks say (`docs/hooks.md`)."""
        named = partial(object_name, host, component)
        unit_objects = tuple(UnitObject(unit.name, named(unit.name), unit.type) for unit in units)
        streams = tuple(
            StreamObject(output.name, named(output.name), output.type, named(unit.name))
            for unit in units
            for output in unit.outputs
        )
        return cls(
            component=component,
            host=host,
            plugin=describe["name"],
            version=describe["version"],
            rank=rank,
            fragments=fragments,
            units=unit_objects,
            streams=streams,
            behaviours=behaviours,
            phrases=phrases,
            labels=labels,
        )

    def local_names(self) -> dict[str, str]:
        """Local name → object: the component's units and slots."""
        return {
            **{unit.local: unit.object for unit in self.units},
            **{stream.slot: stream.object for stream in self.streams},
        }

    def body_facts(self) -> Iterator[str]:
        """What the host may say of the component's objects at rest: each unit is on its body, ready
        and idle; each slot is an output of its unit, and free. What is not so is the host's to
        leave out."""
        for unit in self.units:
            yield fact("on", unit.object, self.host)
            yield fact("ready", unit.object)
            yield fact("idle", unit.object)
        for stream in self.streams:
            yield fact("output", stream.unit, stream.object)
            yield fact("free", stream.object)
