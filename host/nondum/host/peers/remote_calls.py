"""Behaviours of peers' components, asked for like this host's own."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

from nondum.host.core.events.behaviours import BehaviourProgressed
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.printable import printable
from nondum.host.mind.runner import Call as RunCall
from nondum.host.mind.runner import Calls, FactValue
from nondum.host.workers import problems
from nondum.host.workers.call import Call
from nondum.planning.execute.running import RunState
from nondum.planning.merge.contribution import id_at_home
from nondum.sdk.errors import NondumError
from nondum.sdk.wire import Body
from nondum.transport.peers import Call as PeerCall
from nondum.transport.peers import CallFailed

BEHAVE_S = 30 * 86400.0
"""Deadline of a behaviour: the mind's own patience, and the link's death, end it long before."""

log = logging.getLogger(__name__)


class Reaches(Protocol):
    """How peers are reached, by their names."""

    def call(self, host: str, method: str, args: Body, *, deadline_s: float) -> PeerCall:
        """Call a peer. Raises `PeerUnreachable`, `ProtocolViolation`."""
        ...

    def notify(self, host: str, method: str, args: Body) -> None:
        """Tell a peer something. Raises `PeerUnreachable`, `ProtocolViolation`."""
        ...


class RemoteCalls:
    """Satisfies `Calls` for the components of peers, `component@host`."""

    def __init__(
        self, reach: Reaches, emit: Emit, claims: Callable[[str], Iterable[Event]]
    ) -> None:
        """`claims` gives what a peer's component says is so now."""
        self._reach, self._emit, self.claims = reach, emit, claims
        self._ids = itertools.count(1)
        self._running: dict[asyncio.Task[None], Call] = {}

    def behave(
        self,
        component: str,
        behaviour: str,
        arguments: Mapping[str, str],
        values: Sequence[FactValue],
    ) -> Call:
        """Ask a peer's component for a behaviour. Returns at once.

        Raises `PeerUnreachable`, `ProtocolViolation`.
        """
        body = {
            "component": id_at_home(component),
            "behaviour": behaviour,
            "arguments": dict(arguments),
            "values": [[p, list(objects), v] for p, objects, v in values if v is not None],
        }
        asked = self._reach.call(host_of(component), "behave", body, deadline_s=BEHAVE_S)
        call = Call(next(self._ids), component, behaviour, dict(arguments), self._emit)
        call.when_halted(asked.cancel)
        task = asyncio.create_task(self._follow(call, asked))
        self._running[task] = call
        task.add_done_callback(self._running.pop)
        return call

    def tell_values(self, component: str, values: Sequence[FactValue]) -> None:
        """Tell a peer's component new values; what cannot be sent is lost, newer ones follow."""
        body = {
            "component": id_at_home(component),
            "values": [[predicate, list(objects), value] for predicate, objects, value in values],
        }
        try:
            self._reach.notify(host_of(component), "values", body)
        except NondumError as error:
            log.debug("values do not reach %s: %s", component, error)

    async def close(self) -> None:
        """Halt all and wait for their ends."""
        for call in tuple(self._running.values()):
            call.halt()
        for task in tuple(self._running):
            task.cancel()
        await asyncio.gather(*self._running, return_exceptions=True)

    async def _follow(self, call: Call, asked: PeerCall) -> None:
        try:
            async for news in asked:
                self._on_news(call, news)
            call.end(*_outcome(await asked))
        except CallFailed as error:
            halted = error.code == "HALTED"
            state = RunState.HALTED if halted else RunState.FAILED
            call.end(state, problems.words(error))
        except NondumError as error:  # the peer is gone
            call.end(RunState.FAILED, problems.words(error))
        finally:
            call.end(RunState.HALTED, "this host is stopping")  # counts only if nothing else did

    def _on_news(self, call: Call, news: Mapping[str, Any]) -> None:
        if news.get("established") is True:
            call.establish()
        match news.get("progress"):
            case [float() | int() as fraction, str(text)]:
                told = min(max(float(fraction), 0.0), 1.0), printable(text)
                self._emit(BehaviourProgressed(call.component, call.behaviour, call.id, *told))


class AllCalls:
    """This host's own components and those of its peers, behind one face."""

    def __init__(self, own: Calls, peers: RemoteCalls) -> None:
        self._own, self._peers = own, peers

    def behave(
        self,
        component: str,
        behaviour: str,
        arguments: Mapping[str, str],
        values: Sequence[FactValue],
    ) -> RunCall:
        """Start a behaviour on the host of the component. Raises `NondumError`."""
        return self._of(component).behave(component, behaviour, arguments, values)

    def tell_values(self, component: str, values: Sequence[FactValue]) -> None:
        """Send values to the component, on its host."""
        self._of(component).tell_values(component, values)

    def claims(self, component: str) -> Iterable[Event]:
        """What the component says is so."""
        return self._of(component).claims(component)

    def _of(self, component: str) -> Calls:
        return self._peers if is_peers(component) else self._own


def is_peers(component: str) -> bool:
    """Whether a component is a peer's.

    >>> is_peers("front-eye@mule"), is_peers("front-eye")
    (True, False)
    """
    return "@" in component


def host_of(component: str) -> str:
    """The peer that has a component."""
    return component.partition("@")[2]


def _outcome(answer: Mapping[str, Any]) -> tuple[RunState, str]:
    """How a peer says that a behaviour ended."""
    match answer:
        case {"outcome": "SUCCEEDED" | "FAILED" | "HALTED" as outcome, "reason": str(reason)}:
            return RunState[outcome], printable(reason)
    return RunState.FAILED, "its host did not say how it ended"
