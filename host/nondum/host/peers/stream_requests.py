"""Streams to and from peers: what they may read here, and where theirs are fetched."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable

from nondum.host.peers.dispatch import Dispatcher
from nondum.host.peers.peer_entries import reach_of
from nondum.host.peers.peering import Peering
from nondum.host.peers.streams.bridge import Bridge
from nondum.host.peers.streams.remote_streams import RemoteStreams
from nondum.host.peers.streams.shared_streams import SharedStreams
from nondum.host.workers.streams import Streams
from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.transport.discovery import Hint
from nondum.transport.fleet import Fleet
from nondum.transport.peers import CallFailed, IncomingCall, PeerKey

OPEN_S = 10.0
"""What a peer has to open a stream."""


class StreamRequests:
    """Ties this host's streams and its bridge to its peers. `close` it before the fleet."""

    def __init__(
        self,
        bridge: Bridge,
        streams: Streams,
        peering: Peering,
        fleet: Fleet,
        hints: Callable[[], Iterable[Hint]],
    ) -> None:
        self._bridge, self._peering, self._fleet, self._hints = bridge, peering, fleet, hints
        self._shared = SharedStreams(bridge, streams)
        self._remote = RemoteStreams(bridge, self._ask, self._addresses)
        self._parting: set[asyncio.Task[None]] = set()
        streams.reach(self._remote)

    def serve(self, requests: Dispatcher) -> None:
        """Have peers' calls about streams carried out."""
        requests.add("stream.open", self._open)
        requests.add("stream.close", self._close)

    async def expect(self) -> None:
        """A peer is here: streams may cross soon."""
        await self._bridge.expect()

    def lose(self, peer: PeerKey) -> None:
        """A peer is gone: it reads nothing from now on."""
        task = asyncio.get_running_loop().create_task(self._shared.caller_lost(peer))
        self._parting.add(task)
        task.add_done_callback(self._parting.discard)

    async def close(self) -> None:
        """Let go of all streams."""
        await self._remote.close()
        await self._bridge.close()

    async def _open(self, incoming: IncomingCall) -> Body:
        """Let a peer read a stream of an offered unit. Raises `CallFailed` (NOT_OFFERED)."""
        if incoming.args.get("stream") not in self._peering.offered_streams():
            raise CallFailed(Problem("NOT_OFFERED", "no such stream is offered to peers"))
        return await self._shared.serve_open(incoming.caller.key, incoming.args)

    async def _close(self, incoming: IncomingCall) -> Body:
        return await self._shared.serve_close(incoming.caller.key, incoming.args)

    async def _ask(self, host: str, method: str, args: Body) -> Body:
        return await self._peering.call(host, method, args, deadline_s=OPEN_S)

    def _addresses(self, host: str) -> tuple[str, ...]:
        """Where a peer is reached now; none for a host that is no peer."""
        key = self._peering.key_of(host)
        peer = self._fleet.peers.get(key) if key else None
        if peer is None:
            return ()
        hints = (hint.addresses for hint in self._hints() if hint.key == key)
        hinted = (address for addresses in hints for address in addresses)
        told = (f"tcp://{one}:0" for one in reach_of(peer.entries))
        own = (_as_endpoint(peer.address),) if _has_port(peer.address) else ()
        return tuple(dict.fromkeys((*own, *hinted, *told)))


def _has_port(address: str) -> bool:
    return address.rpartition(":")[2].isdigit()


def _as_endpoint(address: str) -> str:
    """Where a peer is, whether it was dialled (`tcp://HOST:PORT`) or has dialled (`HOST:PORT`)."""
    return address if address.startswith("tcp://") else f"tcp://{address}"
