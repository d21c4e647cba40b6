"""Connections over ZeroMQ sockets of this process, dialled and accepted."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import zmq

from nondum.sdk.errors import Problem
from nondum.transport.peers import tcp
from nondum.transport.peers.dialled import Dialled
from nondum.transport.peers.drained import Drained, Sent
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.monitor import HANDSHAKE_FAILED, SocketEvent
from nondum.transport.peers.received import Received
from nondum.transport.peers.refusals import Reason
from nondum.transport.peers.sockets import Receiver


class AcceptedRoute:
    """Over the listening socket, by the routing id that ZeroMQ gave the connection."""

    receiver: Receiver
    """Set by the maker of the route, before it is told anything."""

    def __init__(
        self,
        listener: Drained,
        routing_id: bytes,
        descriptor: int,
        on_peer: Callable[[int], None],
        proved: PeerKey | None,
    ) -> None:
        """`on_peer` is told the descriptor once it is a peer's; `proved` is None without CURVE."""
        self._listener, self._routing_id, self.descriptor = listener, routing_id, descriptor
        self._on_peer, self.proved = on_peer, proved
        self.received = Received(descriptor, is_sealed=proved is not None)
        """The account of what came."""
        self.address = self.received.end
        self.is_peers = False
        self.is_cut = False

    def became_peer(self) -> None:
        """The other end has shown that it is a peer's."""
        self.is_peers = True
        self._on_peer(self.descriptor)

    def drain(self) -> bool:
        """Take in what has come over the socket; whether nothing is left that waits."""
        return self._listener.drain()

    def send(self, data: bytes) -> Sent:
        """Send without waiting."""
        return self._listener.send([self._routing_id, data])

    def cut(self, linger_ms: int = 0) -> None:
        """Shut the connection down, in `linger_ms`."""
        self.is_cut = True
        loop = asyncio.get_running_loop()
        loop.call_later(linger_ms / 1000, tcp.cut, self.descriptor, self.address)


class DialledRoute:
    """Over a separate socket."""

    def __init__(
        self, make: Callable[[], zmq.Socket[bytes]], address: str, receiver: Receiver
    ) -> None:
        """`make` a socket and connect it. Raises `PeerRefused`: ADDRESS_MALFORMED, or
        DIAL_IMPOSSIBLE where there are no descriptors for it, now."""
        self.address = address
        self.received: Received | None = None
        """The account of what came over the connection, once there is one."""
        self.is_peers = False
        """Whether the other end has proved its key."""
        self.is_cut = False
        self._receiver = receiver
        self._dialled = Dialled(make, address, self._take, self._take_event)

    @property
    def receiver(self) -> Receiver:
        """The receiver of its events."""
        return self._receiver

    def send(self, data: bytes) -> Sent:
        """Send without waiting."""
        return self._dialled.socket.send([data])

    def drain(self) -> bool:
        """Take in what has come, if only just before the end; whether nothing is left."""
        return self._dialled.socket.drain()

    def hold(self) -> None:
        """Read nothing until `release`."""
        self._dialled.socket.hold()

    def release(self) -> None:
        """Read again."""
        self._dialled.socket.release()

    def cut(self, linger_ms: int = 0) -> None:
        """Close the socket."""
        self.is_cut = True
        self._dialled.close(linger_ms)

    def _take(self, frames: list[zmq.Frame]) -> None:
        if self.received is not None:
            self.received.delivered(frames)
        if not self.is_peers:
            return
        if len(frames) == 1:
            self._receiver.received(frames[0].bytes)
        else:
            self._receiver.misused(Reason.GARBAGE)

    def _take_event(self, event: SocketEvent) -> None:
        if event.kind == zmq.EVENT_CONNECTED:
            # Also where ZeroMQ dials again by itself: that is another connection.
            self.received = Received(event.value, is_sealed=self._dialled.is_sealed)
        elif event.kind == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            self.is_peers = True
            self._receiver.connected()
        else:
            self._dialled.socket.drain()
            self._receiver.over(_why(event))


def _why(event: SocketEvent) -> Problem | None:
    if event.kind == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
        return Problem(
            "PEER_TURNED_AWAY",
            "the peer does not let this host's key in",
            fix="pair the two hosts, or look at the peer's revoked keys",
        )
    if event.kind & HANDSHAKE_FAILED:
        return Problem(
            "PEER_MISMATCH",
            "the handshake broke off: another key than the one announced, or no keys at all",
            fix="look at `security` and the fingerprints on both hosts",
        )
    return Problem("PEER_SILENT", "no host answers there")
