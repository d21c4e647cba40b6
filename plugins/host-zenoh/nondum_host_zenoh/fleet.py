"""The fleet by way of a Zenoh router: for more hosts than a mesh is good for, and wide areas.

What is secured is the link to the router (TLS; a certificate of this host's, where the router asks
for one). Hosts do not prove their keys to each other, and the router can read their messages: a
host that the router accepts can claim any key. Trust still decides which keys are peers, but relies
on the router for who has which key: `security` and `admitted_by` tell so.
"""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable, Mapping

from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.transport.fleet.catalogues import Catalogues
from nondum.transport.fleet.fleet import FleetEvent, Peer
from nondum.transport.peers.calls import Call
from nondum.transport.peers.events import PeerEvent, PeerUp
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.incoming_calls import Handler
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.node import fresh_epoch
from nondum.transport.peers.refusals import Refusals
from nondum.transport.peers.trust import Trust
from nondum_host_zenoh.line import RouterAccess
from nondum_host_zenoh.node import ZenohNode

STATE_S = 3.0
"""Time between two tellings of this host's state to all."""


class ZenohFleet:
    """A `Fleet` over a router."""

    def __init__(
        self,
        identity: Identity,
        trust: Trust,
        handler: Handler,
        access: RouterAccess,
        *,
        on_event: Callable[[FleetEvent], None],
    ) -> None:
        """Made on the running loop.

        Raises `PeerRefused` (ZENOH_MISSING, ADDRESS_MALFORMED, FLEET_NAME, DEVELOPMENT_LOOPBACK).
        """
        self.epoch = fresh_epoch()
        self._catalogues = Catalogues(self.epoch, handler, on_event, lambda: self._node)
        self._node = ZenohNode(
            identity, trust, self._catalogues, access, epoch=self.epoch, on_event=self._on_event
        )
        self._loop = asyncio.get_running_loop()
        self._telling: asyncio.TimerHandle | None = None

    @property
    def key(self) -> PeerKey:
        """What peers know this host by."""
        return self._node.identity.key

    @property
    def name(self) -> str:
        """What people call it."""
        return self._node.identity.name

    @property
    def security(self) -> Security:
        """How links are secured: by the router, or, without keys, not at all."""
        is_open = self._node.identity.security is Security.DEVELOPMENT
        return Security.DEVELOPMENT if is_open else Security.ROUTER

    @property
    def refusals(self) -> Refusals:
        """Hosts that were turned away, and why."""
        return self._node.refusals

    @property
    def problems(self) -> tuple[Problem, ...]:
        """ROUTER_UNREACHED while no router is reached."""
        problem = self._node.problem
        return (problem,) if problem else ()

    @property
    def peers(self) -> Mapping[PeerKey, Peer]:
        """The peers that can be called now."""
        return self._catalogues.peers

    async def start(self) -> None:
        """Reach a router, for some seconds; after that it is looked for in the background."""
        await self._node.start()
        self._telling = self._loop.call_later(STATE_S, self._tell_state)

    def set_trust(self, trust: Trust) -> None:
        """Exchange the trust: peers that it does not let in any more are cut at once."""
        self._node.set_trust(trust)

    def publish(self, changes: Mapping[str, Body | None]) -> None:
        """Change this host's catalogue."""
        self._catalogues.publish(changes)

    def call(self, peer: PeerKey, method: str, args: Body, *, deadline_s: float) -> Call:
        """Call a peer."""
        return self._node.call(peer, method, args, deadline_s=deadline_s)

    def notify(self, peer: PeerKey, method: str, args: Body) -> None:
        """Tell a peer something."""
        self._node.notify(peer, method, args)

    async def close(self) -> None:
        """Say goodbye and let go of everything."""
        if self._telling is not None:
            self._telling.cancel()
        await self._node.close()
        self._catalogues.close()

    def _tell_state(self) -> None:
        self._telling = self._loop.call_later(STATE_S, self._tell_state)
        self._catalogues.tell_state()

    def _on_event(self, event: PeerEvent) -> None:
        if isinstance(event, PeerUp) and self.security is Security.ROUTER:
            event = dataclasses.replace(event, admitted_by="router")
        self._catalogues.on_event(event)
