"""Streams of this host that peers have opened: what each has, and its end with the peer."""

from __future__ import annotations

import logging
from collections import defaultdict

from nondum.host.bridge.bridge import Bridge
from nondum.host.streams import Streams
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.wire import Body
from nondum.transport import link_sockets
from nondum.transport.peers.keys import PeerKey, parse_key

MOST = 64
"""Streams that one peer may have open."""

log = logging.getLogger(__name__)


class SharedStreams:
    """Answers peers that want to read, or want to no more."""

    def __init__(self, bridge: Bridge, streams: Streams) -> None:
        self._bridge, self._streams = bridge, streams
        self._open: dict[PeerKey, dict[str, str]] = defaultdict(dict)
        """By peer and token: the stream."""

    @property
    def readers(self) -> dict[str, list[PeerKey]]:
        """Peers that read, by stream."""
        found: dict[str, list[PeerKey]] = defaultdict(list)
        for peer, opened in self._open.items():
            for stream in opened.values():
                found[stream].append(peer)
        return dict(found)

    async def serve_open(self, caller: PeerKey, args: Body) -> Body:
        """`stream.open`: let the caller's bridge, by its key, read a stream.

        Raises `WorkerFailed` (STREAM_ARGUMENTS, STREAM_UNKNOWN, STREAM_TOO_MANY, or why the
        producer refused), `PeerRefused` (KEY_MALFORMED), `LinkClosed`.
        """
        match args:
            case {"stream": str(stream), "bridge": str(key)}:
                reader = parse_key(key)
            case _:
                told = "stream.open names a stream and a bridge"
                raise WorkerFailed(Problem("STREAM_ARGUMENTS", told))
        kind = self._streams.kind(stream)
        if len(self._open[caller]) >= MOST:
            raise WorkerFailed(Problem("STREAM_TOO_MANY", f"it reads {MOST} streams already"))
        token = ""

        def on_over(problem: Problem) -> None:
            log.info("%s is not read by a peer any more: %s", stream, problem)
            self._open[caller].pop(token, None)

        ours, theirs = link_sockets()
        with ours, theirs:
            grant = await self._bridge.export(kind, theirs, reader, on_over)
            token = grant.token
            self._open[caller][token] = stream
            try:
                await self._streams.tap(stream, ours)
            except BaseException:
                await self._end(caller, token)
                raise
        return {"type": kind, "port": grant.port, "key": grant.key, "token": token}

    async def serve_close(self, caller: PeerKey, args: Body) -> Body:
        """`stream.close`: the caller reads a stream no more; unknown ones are ignored."""
        match args:
            case {"token": str(token)} if token in self._open.get(caller, {}):
                await self._end(caller, token)
        return {}

    async def caller_lost(self, caller: PeerKey) -> None:
        """A peer is gone, or is trusted no more: it reads nothing from now on."""
        for token in list(self._open.pop(caller, {})):
            await self._bridge.unexport(token)

    async def _end(self, caller: PeerKey, token: str) -> None:
        self._open[caller].pop(token, None)
        await self._bridge.unexport(token)
