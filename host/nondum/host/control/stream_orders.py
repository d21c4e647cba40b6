"""What people's tools may have a host do about streams: connect them to inputs, tap them."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments
from nondum.host.control.committed import until_committed
from nondum.host.control.news import News
from nondum.host.control.server import Handing
from nondum.host.core.bus import Bus
from nondum.host.core.events.inputs import InputConnected
from nondum.host.core.names import whole
from nondum.host.core.row import Row
from nondum.host.core.unknown import unknown
from nondum.host.mind.mind import Mind
from nondum.host.workers.optional_inputs import Socket
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.frozen import frozen
from nondum.transport import link_sockets


@frozen
class StreamOrders:
    """Each method is a verb."""

    catalogue: Catalogue
    mind: Mind
    workers: Workers
    news: News
    bus: Bus

    async def connect(self, arguments: Arguments) -> Row:
        """Connect a stream to an optional input for good; without one the host picks again.

        Raises `NondumError` (INPUT_UNKNOWN, STREAM_UNKNOWN, INPUT_STREAM).
        """
        name, said = arguments.text("input"), arguments.optional_text("stream") or ""
        stream = whole(said, self.mind.names)
        sockets = {choice.socket.name: choice.socket for choice in self.workers.streams.inputs()}
        before = dict(self.catalogue.snapshot().connections)
        if name not in sockets and (stream or name not in before):
            raise NondumError(unknown("input", name, {*sockets, *before}))
        if stream:
            self._check_fits(sockets[name], stream)
        if stream != before.get(name, ""):
            self.bus.emit(InputConnected(name, stream))
            await until_committed(
                self.catalogue, self.news, lambda now: dict(now.connections).get(name, "") == stream
            )
        return {"input": name, "stream": stream or None, "was": before.get(name)}

    async def tap(self, arguments: Arguments) -> Handing:
        """Hand the client a consumer's end of a stream. Raises `NondumError`."""
        name = whole(arguments.text("stream"), self.mind.names)
        found = {s.stream: s for s in self.workers.streams.listing()}
        if name not in found:
            raise NondumError(unknown("stream", name, found))
        ours, theirs = link_sockets()
        with ours:
            try:
                await self.workers.streams.tap(name, ours)
            except BaseException:
                theirs.close()
                raise
        return Handing({"stream": name, "type": found[name].type}, theirs)

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {"connect": self.connect, "tap": self.tap}

    def _check_fits(self, socket: Socket, stream: str) -> None:
        sources = {source.stream: source for source in self.workers.streams.sources()}
        fitting = [name for name, source in sources.items() if socket.takes(source)]
        if stream not in sources:
            raise NondumError(unknown("stream", stream, fitting))
        if stream not in fitting:
            have = f"a stream of type {sources[stream].type} of {sources[stream].component}"
            raise NondumError(
                Problem(
                    "INPUT_STREAM",
                    f"{stream} cannot feed the input {socket.name}",
                    need=f"a stream of type {socket.type} of another component",
                    have=have,
                    fix=f"there is: {', '.join(fitting) or 'none'}",
                )
            )
