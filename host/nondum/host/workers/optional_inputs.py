"""Which stream feeds which optional input, and why: by type, by what it is of, by a person's word.

Pure. Optional inputs are in no plan. Each gets a stream that flows, is of its type, comes from
another component of this host, and tells of the type of unit that the input asks for. Where several
fit, it is the first by name, and that is told; what a person has connected counts before all of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from nondum.planning.merge.contribution import object_name
from nondum.planning.merge.kinds import kinds_of
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport import Wire


@dataclass(frozen=True, slots=True, order=True)
class Source:
    """A stream that a component can produce."""

    stream: str
    """Object name."""
    type: str
    component: str
    of: frozenset[str] = field(default=frozenset(), compare=False)
    """The types of unit that it tells of."""


@frozen
class Socket:
    """An optional input."""

    component: str
    unit: str
    slot: str
    type: str
    of: str = ""
    """The type of unit that a stream must tell of; empty: of any."""

    @property
    def name(self) -> str:
        """What people call it."""
        return f"{self.component}.{self.unit}.{self.slot}"

    def takes(self, source: Source) -> bool:
        """Whether a stream could be wired to it at all, if a person says so."""
        return source.type == self.type and source.component != self.component

    def fits(self, source: Source) -> bool:
        """Whether a stream is what it asks for."""
        return self.takes(source) and self.of in ("", *source.of)


@frozen
class Choice:
    """What feeds one optional input now."""

    socket: Socket
    source: Source | None
    chosen: str = ""
    """The stream that a person has connected; empty: none, the host picks."""
    others: tuple[str, ...] = ()
    """Further streams that flow and fit as well."""

    @property
    def wire(self) -> Wire | None:
        """The wire that this asks for."""
        if self.source is None:
            return None
        socket, source = self.socket, self.source
        return Wire(
            *(source.stream, source.type, source.component),
            *(socket.component, socket.unit, socket.slot),
        )

    @property
    def is_ambiguous(self) -> bool:
        """Whether the host has picked one of several that fit equally."""
        return bool(self.others) and not self.chosen

    def problem(self) -> Problem:
        """What is told of a choice that is ambiguous."""
        assert self.source is not None
        name = self.socket.name
        return Problem(
            "INPUT_AMBIGUOUS",
            f"several streams fit the input {name}: it gets the first by name",
            where=self.socket.component,
            have=", ".join((self.source.stream, *self.others)),
            fix=f"say which it is to be: nondum streams --connect {name} STREAM",
        )


def choose(
    sockets: Iterable[Socket], flowing: Iterable[Source], connected: Mapping[str, str]
) -> tuple[Choice, ...]:
    """What feeds each optional input, by the inputs' names.

    `connected` is what people have said: name of an input → stream. An input that was connected to
    a stream which does not flow gets none: not another one behind a person's back.
    """
    offered = sorted(flowing)
    ordered = sorted(sockets, key=lambda socket: socket.name)
    return tuple(_choice(socket, offered, connected.get(socket.name, "")) for socket in ordered)


def _choice(socket: Socket, offered: list[Source], chosen: str) -> Choice:
    if chosen:
        found = (s for s in offered if s.stream == chosen and socket.takes(s))
        return Choice(socket, next(found, None), chosen)
    fitting = [source for source in offered if socket.fits(source)]
    others = tuple(source.stream for source in fitting[1:])
    return Choice(socket, fitting[0] if fitting else None, others=others)


def sources_of(host: str, component: str, description: PluginDescription) -> Iterator[Source]:
    """The streams that a component can produce. What one is of: its unit, or what it says."""
    kinds = kinds_of(description)
    for unit in description.units:
        for output in unit.outputs:
            stream = object_name(host, component, output.name)
            yield Source(stream, output.type, component, kinds(output.of or unit.type))


def sockets_of(component: str, description: PluginDescription) -> Iterator[Socket]:
    """The optional inputs that a component has."""
    for unit in description.units:
        for slot in unit.inputs:
            yield Socket(component, unit.name, slot.name, slot.type, slot.of)
