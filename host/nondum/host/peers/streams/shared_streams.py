"""Streams of this host that peers have opened: what each has, and its end with the peer."""

from __future__ import annotations

import logging
from collections import defaultdict
from dataclasses import dataclass

from nondum.host.peers.streams.bridge import Bridge
from nondum.host.workers.streams import Streams
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.wire import Body
from nondum.transport import link_sockets
from nondum.transport.peers.keys import PeerKey, parse_key

MOST = 64
"""Streams that one peer may have open."""

log = logging.getLogger(__name__)


@dataclass(eq=False, slots=True)
class _Opened:
    stream: str
    token: str = ""
    """Of the grant, once there is one."""


class SharedStreams:
    """Answers peers that want to read, or want to no more."""

    def __init__(self, bridge: Bridge, streams: Streams) -> None:
        self._bridge, self._streams = bridge, streams
        self._opened: dict[PeerKey, set[_Opened]] = defaultdict(set)

    @property
    def readers(self) -> dict[str, list[PeerKey]]:
        """Peers that read, by stream."""
        found: dict[str, list[PeerKey]] = defaultdict(list)
        for peer, all_opened in self._opened.items():
            for opened in all_opened:
                found[opened.stream].append(peer)
        return dict(found)

    async def serve_open(self, caller: PeerKey, args: Body) -> Body:
        """`stream.open`: let the caller's bridge, by its key, read a stream.

        Raises `WorkerFailed` (STREAM_ARGUMENTS, STREAM_UNKNOWN, STREAM_TOO_MANY, or why the
        producer refused), `PeerRefused` (KEY_MALFORMED), `LinkClosed`.
        """
        match args:
            case {"stream": str(stream), "bridge": str(key)}:
                reader, kind = parse_key(key), self._streams.kind(stream)
            case _:
                told = "stream.open names a stream and a bridge"
                raise WorkerFailed(Problem("STREAM_ARGUMENTS", told))
        if len(self._opened[caller]) >= MOST:
            raise WorkerFailed(Problem("STREAM_TOO_MANY", f"it reads {MOST} streams already"))
        opened = _Opened(stream)
        self._opened[caller].add(opened)

        def on_over(problem: Problem) -> None:
            log.info("%s is not read by a peer any more: %s", stream, problem)
            self._opened[caller].discard(opened)

        ours, theirs = link_sockets()
        with ours, theirs:
            try:
                grant = await self._bridge.export(kind, theirs, reader, on_over)
                opened.token = grant.token
                await self._streams.tap(stream, ours)
            except BaseException:
                await self._end(caller, opened)
                raise
        if opened not in self._opened[caller]:  # the caller was lost meanwhile
            await self._bridge.unexport(opened.token)
        return {"type": kind, "port": grant.port, "key": grant.key, "token": grant.token}

    async def serve_close(self, caller: PeerKey, args: Body) -> Body:
        """`stream.close`: the caller reads a stream no more; unknown ones are ignored."""
        for opened in list(self._opened.get(caller, ())):
            if opened.token and opened.token == args.get("token"):
                await self._end(caller, opened)
        return {}

    async def caller_lost(self, caller: PeerKey) -> None:
        """A peer is gone, or is trusted no more: it reads nothing from now on."""
        for opened in self._opened.pop(caller, set()):
            await self._bridge.unexport(opened.token)

    async def _end(self, caller: PeerKey, opened: _Opened) -> None:
        self._opened[caller].discard(opened)
        await self._bridge.unexport(opened.token)
