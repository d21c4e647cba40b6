"""The fleet as a full mesh: an authenticated link to every other host."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Protocol, TypeAlias

from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.transport.fleet.catalogues import Catalogues
from nondum.transport.fleet.dialling import DialPolicy
from nondum.transport.fleet.fleet import FleetEvent, Peer
from nondum.transport.peers.allowance import USUAL, Allowance
from nondum.transport.peers.calls import Call
from nondum.transport.peers.events import DialFailed, PeerEvent, PeerLost, PeerUp
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.incoming_calls import Handler
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.local_sockets import LocalSockets
from nondum.transport.peers.node import PeerNode, fresh_epoch
from nondum.transport.peers.pulse import Pulse
from nondum.transport.peers.refusals import Refusals
from nondum.transport.peers.sockets import MakeSockets
from nondum.transport.peers.trust import Trust, TrustState


class Finder(Protocol):
    """Looks for hosts, and tells where they are by `Mesh.meet` and `Mesh.no_more_hints`."""

    async def start(self) -> None:
        """Begin to look."""

    async def close(self) -> None:
        """Look no more."""


Find: TypeAlias = Callable[["Mesh"], Finder]
"""Makes a finder for a mesh that listens already (`addresses`)."""


class Mesh:
    """A `Fleet` over `PeerNode`."""

    def __init__(
        self,
        identity: Identity,
        trust: Trust,
        handler: Handler,
        *,
        on_event: Callable[[FleetEvent], None],
        listen: Sequence[str] = ("tcp://*:0",),
        find: Find | None = None,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
        allowance: Allowance = USUAL,
        sockets: MakeSockets = LocalSockets,
    ) -> None:
        """Made on the running loop. Without `find`, hosts meet by `meet` only.

        `clock` tells the time of day, which only certificates need; `allowance` is what each peer
        may send; `sockets` makes what its links go over.
        """
        self.epoch = fresh_epoch()
        self.addresses: tuple[str, ...] = ()
        """Where it listens, once it has started."""
        self._trust, self._listen, self._find = trust, tuple(listen), find
        self._catalogues = Catalogues(self.epoch, handler, on_event, lambda: self._node)
        self._node = PeerNode(
            identity,
            trust,
            self._catalogues,
            on_event=self._on_event,
            pulse=Pulse(self._catalogues.state, self._catalogues.receive_state),
            epoch=self.epoch,
            clock=clock,
            allowance=allowance,
            sockets=sockets,
        )
        self._meeting = DialPolicy(identity.key, self._node, self.is_welcome)
        self._finder: Finder | None = None

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
        """How links are secured."""
        return self._node.security

    @property
    def links_pid(self) -> int | None:
        """The process that holds the sockets of its links; None while there is none."""
        return self._node.links_pid

    @property
    def refusals(self) -> Refusals:
        """Hosts that were turned away, and why."""
        return self._node.refusals

    @property
    def problems(self) -> tuple[Problem, ...]:
        """None: hosts are looked for one by one."""
        return ()

    @property
    def peers(self) -> Mapping[PeerKey, Peer]:
        """The peers that can be called now."""
        return self._catalogues.peers

    async def start(self) -> None:
        """Listen, then look for others. Raises `PeerRefused` as `PeerNode.start`; it may then be
        tried again."""
        self.addresses = await self._node.start(self._listen)
        if self._find is not None:
            self._finder = self._find(self)
            await self._finder.start()

    def listen_at(self, addresses: Sequence[str]) -> None:
        """Have it listen elsewhere, once it is started."""
        self._listen = tuple(addresses)

    def meet(self, key: PeerKey, addresses: Sequence[str], epoch: int = 0) -> None:
        """A host may be at these addresses, in this epoch if that is known; where it is let in, it
        is dialled. Raises `PeerRefused` as `PeerNode.dial`."""
        for address in addresses:
            self._node.identity.check_address(address)
        self._meeting.hinted(key, addresses, epoch)
        self._node.expected = self._meeting.looked_for

    def check_address(self, address: str) -> None:
        """Refuse addresses that this host does not dial. Raises `PeerRefused`."""
        self._node.identity.check_address(address)

    def no_more_hints(self, key: PeerKey) -> None:
        """No hint names a host any more. A link to it stays while it works."""
        self._meeting.gone(key)

    def set_trust(self, trust: Trust) -> None:
        """Exchange the trust: peers that it does not let in any more are cut at once."""
        self._trust = trust
        self._node.set_trust(trust)
        self._meeting.trust_changed()

    def show_certificate(self, certificate: bytes) -> None:
        """Show another certificate from now on, also to those who have turned this host away."""
        self._node.show_certificate(certificate)
        self._meeting.again()

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
        self._meeting.close()
        await self._node.close()  # peers first: multicast takes its time to say goodbye
        if self._finder is not None:
            await self._finder.close()
        self._catalogues.close()

    def is_welcome(self, key: PeerKey) -> bool:
        """Whether a host might be let in, by its key alone."""
        if self.security is Security.DEVELOPMENT:
            return True
        return self._trust.state_of(key) in (TrustState.ADMITTED, TrustState.MUST_CERTIFY)

    def _on_event(self, event: PeerEvent) -> None:
        match event:
            case PeerUp():
                self._meeting.up(event)
            case PeerLost():
                self._meeting.lost(event.key)
            case DialFailed():
                self._meeting.turn_over(event.key)
            case _:
                pass
        self._catalogues.on_event(event)
