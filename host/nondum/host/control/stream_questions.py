"""What people's tools may ask about streams and optional inputs."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from nondum.host.control.arguments import Arguments
from nondum.host.control.rows import (
    input_row,
    stream_row,
)
from nondum.host.core.row import Row
from nondum.host.workers.workers import Workers
from nondum.sdk.frozen import frozen


@frozen
class StreamQuestions:
    """Each method is a verb; none changes anything."""

    workers: Workers

    async def streams(self, arguments: Arguments) -> list[Row]:
        """The streams: the producer, the readers and the rate of each."""
        rates = self.workers.rates()
        listing = self.workers.streams.listing()
        return [stream_row(stream, rates.get(stream.stream)) for stream in listing]

    async def inputs(self, arguments: Arguments) -> list[Row]:
        """The optional inputs, and what feeds each."""
        streams = self.workers.streams
        return [input_row(choice, streams.sources()) for choice in streams.inputs()]

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {"inputs": self.inputs, "streams": self.streams}
