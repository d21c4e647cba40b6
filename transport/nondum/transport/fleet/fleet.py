"""The other hosts, however they are reached: what a host's daemon sees of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, TypeAlias

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.wire import Body
from nondum.transport.peers.calls import Call
from nondum.transport.peers.events import PeerEvent
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.refusals import Refusals
from nondum.transport.peers.trust import Trust

OWN_METHODS = "fleet."
"""Calls and notices that begin so are the fleet's own: no handler ever sees one."""


@frozen
class Peer:
    """A host that can be called, and what it tells about itself."""

    key: PeerKey
    name: str
    epoch: int
    address: str
    admitted_by: str
    """`pairing`, `certificate`, `development`, or `router` (by whose word it has this key)."""
    revision: int
    """Of its catalogue; 0 before that was read for the first time."""
    entries: Mapping[str, Body]
    """Its catalogue, as of that revision. Never changed: the next revision is another mapping."""
    round_trip_s: float | None
    """The last ping's time there and back; None before one was answered."""


@frozen
class PeerChanged:
    """A peer's catalogue is another one."""

    key: PeerKey
    changes: Mapping[str, Body | None]
    """By key of the entry; None for one that is gone."""
    is_whole: bool
    """Whether these are all its entries, whatever was known before: so the first one after every
    `PeerUp` is, also when nothing changed while the peer was away."""


FleetEvent: TypeAlias = PeerEvent | PeerChanged


class Fleet(Protocol):
    """The peers of one host. `await start()` it, and `await close()` it.

    Events are told in order, on the loop: of one peer `PeerUp`, `PeerChanged` (the first one
    whole), `PeerLost`. Calls work from `PeerUp` on.
    """

    @property
    def key(self) -> PeerKey:
        """What peers know this host by."""

    @property
    def epoch(self) -> int:
        """Tells this life of the host from earlier ones."""

    @property
    def security(self) -> Security:
        """How links are secured; to be shown with every status."""

    @property
    def refusals(self) -> Refusals:
        """Hosts that were turned away, and why."""

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What keeps this host from all others now; to be shown with every status."""

    async def start(self) -> None:
        """Be there for peers. Raises `PeerRefused` for what cannot be listened at."""

    def set_trust(self, trust: Trust) -> None:
        """Exchange the trust: peers that it does not let in any more are cut at once."""

    def publish(self, changes: Mapping[str, Body | None]) -> None:
        """Change this host's catalogue, by keys of entries; None removes one.

        One call is one revision, and peers see all of it or nothing; calls that follow each other
        within some milliseconds reach them as one. May be called before `start`. Raises
        `EntryRefused` (ENTRY_TOO_LONG, ENTRY_KEY, CATALOGUE_TOO_LONG), and `ProtocolViolation` or
        `TypeError` for what is no plain data; nothing is changed then.
        """

    @property
    def peers(self) -> Mapping[PeerKey, Peer]:
        """The peers that can be called now."""

    def call(self, peer: PeerKey, method: str, args: Body, *, deadline_s: float) -> Call:
        """Call a peer; await the result for the answer, or iterate over its progress.

        Raises `PeerUnreachable` (PEER_DOWN, PEER_BUSY), and `ProtocolViolation` or `TypeError` for
        what cannot be sent.
        """

    def notify(self, peer: PeerKey, method: str, args: Body) -> None:
        """Tell a peer something; at most once, and not at all when the link breaks.

        Raises as `call` does.
        """

    async def close(self) -> None:
        """Say goodbye and let go of everything; what runs for peers is cancelled."""
