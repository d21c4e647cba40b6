"""The interface beneath a host's links: sockets in this process, or in a separate one.

On one side are connections and who may make them, on the other what peers say over them.
`local_sockets.py` and `socket_process/` have the two kinds of sockets, `node.py` is their owner.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeAlias

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.identity import Identity
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.link import Route
from nondum.transport.peers.refusals import Reason, Refusal
from nondum.transport.peers.trust import Trust


class Accepted(Route, Protocol):
    """A connection that another host has made: a stranger's, and bounded as such, at first."""

    def became_peer(self) -> None:
        """The other end has shown that it is a peer's."""


class Receiver(Protocol):
    """The receiver of the events of one connection, on the loop."""

    def connected(self) -> None:
        """The other end has proved its key. Not told of accepted ones: they begin so."""

    def received(self, data: bytes) -> None:
        """A message came."""

    def misused(self, reason: Reason) -> None:
        """What came is no message of a host's (NOT_PROVED, GARBAGE, ENDLESS)."""

    def doubtful(self) -> None:
        """It may be over: sending over it tells. Told of accepted ones only."""

    def over(self, problem: Problem | None) -> None:
        """It is over, or was never made; why, where that is known."""


@frozen
class Owner:
    """What the sockets ask and tell of themselves, on the loop."""

    on_accepted: Callable[[Accepted, PeerKey | None], Receiver]
    """The first message of another host's connection has come, and is told next. The key is the one
    that was proved, None in development mode."""
    on_refusal: Callable[[Refusal], None]
    """A host was turned away, or cut before it became a peer."""
    on_failed: Callable[[Problem], None]
    """All connections are over for a fault of the sockets' own; new ones will be made again."""
    awake_s: Callable[[], float]
    """How long the owner's loop has run: while it stands still, no one can show who it is."""


class Sockets(Protocol):
    """Connections to other hosts. `await listen(…)`, and `await close()` it."""

    @property
    def pid(self) -> int | None:
        """The process that holds them; None while there is none."""

    @property
    def strangers(self) -> int:
        """How many accepted connections are not a peer's yet."""

    async def listen(self, addresses: Sequence[str]) -> tuple[str, ...]:
        """Listen, and answer the addresses as bound. After a failure it may be tried again.

        Nothing is bound before the socket has turned away a stranger. Raises `PeerRefused`
        (ZAP_INEFFECTIVE, ZAP_TAKEN, ADDRESS_UNUSABLE; LINKS_START).
        """

    def dial(self, key: PeerKey, address: str, receiver: Receiver) -> Route:
        """Begin one connection to a host that must prove this key.

        Raises `PeerRefused` (ADDRESS_MALFORMED, DIAL_IMPOSSIBLE), or tells it later.
        """

    def set_trust(self, trust: Trust) -> None:
        """Judge by this trust who may connect from now on."""

    async def close(self) -> None:
        """Let go of everything; what was sent last may take a moment to leave."""


MakeSockets: TypeAlias = Callable[[Identity, Trust, Owner], Sockets]
"""Makes them on the running loop, for a host and its trust."""
