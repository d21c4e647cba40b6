"""Behaviours of this host's components that are carried out for peers.

They end with their caller, as their author declared: stopped, held, or finished. All hosts, this
one included, are told what they use, so that no host plans with it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from nondum.host.core.events.behaviours import (
    BehaviourEnded,
    BehaviourEstablished,
    BehaviourProgressed,
)
from nondum.host.core.events.event import Event
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.composition import Composition, own_objects
from nondum.host.peers.offered_entries import Policy
from nondum.host.peers.uses import taken_by
from nondum.host.workers.call import Call
from nondum.planning.execute.running import RunState
from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.messages import value_from_wire
from nondum.sdk.signature import parse_signature
from nondum.sdk.wire import Body
from nondum.transport.peers import CallFailed, IncomingCall, Lease, Loss

SIGN_S = 1.0
"""Time between two signs of life of a behaviour: reports may be lost on the way, so how it is told
again and again."""

FactValue = tuple[str, tuple[str, ...], Any]


class Behaves(Protocol):
    """What is needed of the workers."""

    def behave(
        self,
        component: str,
        behaviour: str,
        arguments: Mapping[str, str],
        values: Sequence[FactValue],
    ) -> Call:
        """Ask a component for a behaviour."""
        ...

    def tell_values(self, component: str, values: Sequence[FactValue]) -> None:
        """Tell a component new values."""
        ...


@frozen
class Asked:
    """What a peer wants of a component."""

    component: str
    behaviour: str
    arguments: Mapping[str, str]
    values: tuple[FactValue, ...]

    @classmethod
    def parse(cls, args: Mapping[str, Any]) -> Asked:
        """Read the arguments of `behave`. Raises `CallFailed` (CALL_MALFORMED)."""
        match args:
            case {
                "component": str(component),
                "behaviour": str(behaviour),
                "arguments": dict(arguments),
                "values": list(values),
            } if all(isinstance(k, str) and isinstance(v, str) for k, v in arguments.items()):
                return cls(component, behaviour, arguments, tuple(map(_value, values)))
        raise CallFailed(_malformed("component, behaviour, arguments and values"))


@dataclass(slots=True, eq=False)
class Served:
    """One behaviour that runs for a peer."""

    incoming: IncomingCall
    asked: Asked
    unit: str
    """The actor."""
    call: Call
    taken: frozenset[str]
    progress: tuple[float, str] | None = None
    news: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def caller(self) -> str:
        """The name of the peer."""
        return self.incoming.caller.name


class Serving:
    """Carries out what peers ask of this host's components."""

    def __init__(
        self,
        workers: Behaves,
        snapshot: Callable[[], Snapshot],
        composition: Callable[[], Composition | None],
        policy: Callable[[], Policy],
        own_uses: Callable[[], Iterable[str]],
        on_change: Callable[[], None],
    ) -> None:
        """`own_uses` are the facts that this host's own behaviours take; `on_change` is called
        whenever `taken` may be another."""
        self._workers, self._snapshot, self._composition = workers, snapshot, composition
        self._policy, self._own_uses, self._on_change = policy, own_uses, on_change
        self._served: dict[tuple[str, int], Served] = {}

    def __iter__(self) -> Iterator[Served]:
        """All that runs for peers."""
        return iter(tuple(self._served.values()))

    @property
    def taken(self) -> dict[str, str]:
        """Facts that do not hold now → the peer that uses what they are about."""
        return {text: served.caller for served in self for text in served.taken}

    def on_event(self, event: Event) -> None:
        """Take in news of behaviours."""
        match event:
            case BehaviourProgressed(component, _, call_id, fraction, text):
                if served := self._served.get((component, call_id)):
                    served.progress = fraction, text
                    served.news.set()
            case BehaviourEstablished(component, _, call_id) | BehaviourEnded(
                component, _, call_id
            ):
                if served := self._served.get((component, call_id)):
                    served.news.set()

    async def behave(self, incoming: IncomingCall) -> Body:
        """Carry out a behaviour for a peer: `outcome` and `reason`.

        Progress has `established` and, once told, `progress`. Raises `CallFailed` (CALL_MALFORMED,
        NOT_OFFERED, UNIT_TAKEN) and what the workers raise.
        """
        asked = Asked.parse(incoming.args)
        plugin, unit = self._check_offered(asked)
        taken = self._uses(plugin, asked)
        await self._supersede(incoming, taken)
        self._check_untaken(taken)
        self._check_users(asked.component, unit)
        call = self._workers.behave(asked.component, asked.behaviour, asked.arguments, asked.values)
        served = Served(incoming, asked, unit, call, taken)
        self._served[call.component, call.id] = served
        self._on_change()
        try:
            return await self._follow(served)
        except asyncio.CancelledError:
            call.halt()
            await call.ended()
            raise
        finally:
            self._served.pop((call.component, call.id), None)
            self._on_change()

    def values(self, caller: str, args: Mapping[str, Any]) -> None:
        """Pass new values on to a component that runs something for the peer."""
        match args:
            case {"component": str(component), "values": list(values)} if any(
                served.caller == caller and served.asked.component == component for served in self
            ):
                self._workers.tell_values(component, tuple(map(_value, values)))

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        """What becomes of a behaviour whose caller is lost: as its author declared."""
        served = next((one for one in self if one.incoming is incoming), None)
        described = self._described(served.asked) if served else None
        if described is None or reason in (Loss.REVOKED, Loss.EXPIRED, Loss.VIOLATED):
            return Lease.STOP
        when_lost, is_lasting = described
        match when_lost:
            case "hold":
                return Lease.HOLD
            case "finish":
                return Lease.HOLD if is_lasting else Lease.FINISH
        return Lease.STOP

    def halt_all(self) -> tuple[str, ...]:
        """Halt all that runs for peers: a person here wants it. Gives what was asked to end."""
        names = tuple(f"{one.asked.behaviour} of {one.asked.component}" for one in self)
        for served in self:
            served.call.halt()
        return names

    async def _follow(self, served: Served) -> Body:
        call, incoming = served.call, served.incoming
        ending = asyncio.ensure_future(call.ended())
        try:
            while not call.state.has_ended:
                served.news.clear()
                report: dict[str, Any] = {"established": call.state is RunState.ESTABLISHED}
                if served.progress is not None:
                    report["progress"] = list(served.progress)
                incoming.progress(report)
                news = asyncio.ensure_future(served.news.wait())
                await asyncio.wait(
                    {ending, news}, timeout=SIGN_S, return_when=asyncio.FIRST_COMPLETED
                )
                news.cancel()
        finally:
            ending.cancel()
        return {"outcome": call.state.name, "reason": call.reason}

    async def _supersede(self, incoming: IncomingCall, taken: frozenset[str]) -> None:
        """End what the same host had asked of the same units: it has lost that, or it would not ask
        again. What is being halted already is waited for."""
        earlier = [
            served
            for served in self
            if served.caller == incoming.caller.name and served.taken & taken
        ]
        for served in earlier:
            served.call.halt()
        for served in earlier:
            await served.call.ended()
            self._served.pop((served.call.component, served.call.id), None)

    def _check_untaken(self, taken: frozenset[str]) -> None:
        in_use = {**dict.fromkeys(self._own_uses(), self._snapshot().host), **self.taken}
        for text in sorted(taken & in_use.keys()):
            told = f"{text.partition(' ')[2]} is used by {in_use[text]}"
            fix = "it is free when that ends"
            raise CallFailed(Problem("UNIT_TAKEN", told, fix=fix))

    def _check_users(self, component: str, unit: str) -> None:
        """Units say how many users they serve. Raises `CallFailed` (UNIT_TAKEN)."""
        most = self._most_users(component, unit)
        users = [served.caller for served in self if served.unit == unit]
        if most and len(users) >= most:
            told = f"{unit} serves {most} at once, and now {', '.join(sorted(users))}"
            raise CallFailed(Problem("UNIT_TAKEN", told, fix="it is free when one of them ends"))

    def _most_users(self, component: str, unit: str) -> int:
        found = self._snapshot().component(component)
        names = own_objects(self._snapshot().host, found) if found else {}
        units = found.description.units if found else ()
        return next((one.users for one in units if names[one.name] == unit), 0)

    def _check_offered(self, asked: Asked) -> tuple[str, str]:
        """The plugin and the unit that are asked.

        Raises `CallFailed` (NOT_OFFERED, CALL_MALFORMED).
        """
        snapshot = self._snapshot()
        component = snapshot.component(asked.component)
        offer = self._policy().offer(component) if component else None
        if component is None or offer is None or not offer.brings(asked.behaviour):
            raise CallFailed(_not_offered(asked, "no such behaviour of it is offered to peers"))
        action = next(b.action for b in offer.description.behaviours if b.name == asked.behaviour)
        parameters = [parameter.name for parameter in parse_signature(action).parameters]
        if sorted(parameters) != sorted(asked.arguments):
            raise CallFailed(_malformed(f"arguments for {', '.join(parameters)}"))
        names = own_objects(snapshot.host, component)
        units = {names[unit.name] for unit in offer.description.units}
        actor = asked.arguments[parameters[0]]
        if actor not in units:
            raise CallFailed(_not_offered(asked, "the unit is not offered to peers"))
        return component.description.name, actor

    def _uses(self, plugin: str, asked: Asked) -> frozenset[str]:
        composition = self._composition()
        if composition is None:
            return frozenset()
        return taken_by(composition.merged, plugin, asked.behaviour, asked.arguments)

    def _described(self, asked: Asked) -> tuple[str, bool] | None:
        """What its author says of a behaviour: `when_lost`, and whether it lasts."""
        component = self._snapshot().component(asked.component)
        for described in component.description.behaviours if component else ():
            if described.name == asked.behaviour:
                return described.when_lost, described.lasting
        return None


def _value(value: object) -> FactValue:
    match value:
        case [str(predicate), list(objects), carried] if all(isinstance(o, str) for o in objects):
            try:
                return predicate, tuple(objects), carried and _checked(carried)
            except MessageInvalid as error:
                raise CallFailed(*error.problems) from error
    raise CallFailed(_malformed("values as [predicate, objects, value]"))


def _checked(carried: object) -> object:
    value_from_wire(carried)
    return carried


def _malformed(need: str) -> Problem:
    return Problem("CALL_MALFORMED", "a call's arguments are not what it takes", need=need)


def _not_offered(asked: Asked, why: str) -> Problem:
    fix = "the integrator says which actuators peers may use: `offer_actuators` under [peers]"
    return Problem("NOT_OFFERED", why, where=f"{asked.component}: {asked.behaviour}", fix=fix)
