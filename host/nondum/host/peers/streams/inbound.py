"""A stream of another host, produced here once for any number of readers."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from nondum.host.peers.streams import jpeg
from nondum.sdk.errors import NondumError, Problem, WorkerFailed
from nondum.sdk.messages import MESSAGES, message_from_wire
from nondum.sdk.streams import Producer
from nondum.transport.peers.keys import HostKeys
from nondum.transport.streams import Coding, Frame, Incoming, Place
from nondum.transport.streams.sockets import Context

log = logging.getLogger(__name__)


class Inbound:
    """One connection to the stream's host, and the producer here. `close` it."""

    def __init__(
        self,
        context: Context,
        keys: HostKeys,
        place: Place,
        kind: str,
        on_over: Callable[[Problem], None],
    ) -> None:
        """`on_over` is called once when the stream, once opened, has ended; not after `close`."""
        self.producer = Producer(kind)
        self._on_over = on_over
        self._loop = asyncio.get_running_loop()
        self.opened: asyncio.Future[None] = self._loop.create_future()
        """Settled when frames follow, or with the `WorkerFailed` that says why none will."""
        self._waiting: deque[Frame] = deque()
        self._restoring: asyncio.Task[None] | None = None
        self._incoming = Incoming(
            context,
            keys,
            place,
            on_opened=self._on_opened,
            on_frame=self._on_frame,
            on_over=self._stop,
        )

    def figures(self) -> dict[str, Any]:
        """What came so far, and who reads it."""
        return {
            "bytes": self._incoming.bytes_received,
            "readers": list(self.producer.consumers),
        }

    def close(self) -> None:
        """Let go of the connection and end the stream for all readers."""
        self._incoming.close()
        self._waiting.clear()
        if self._restoring is not None:
            self._restoring.cancel()
        if not self.opened.done():
            self.opened.cancel()
        self.producer.close()

    def _on_opened(self, kind: str) -> None:
        if kind != self.producer.kind or kind not in MESSAGES:
            told = f"the stream is of type {kind}, not {self.producer.kind}"
            self._stop(Problem("STREAM_TYPE", told))
        elif not self.opened.done():
            self.opened.set_result(None)

    def _on_frame(self, frame: Frame) -> None:
        self._waiting.append(frame)
        self._take_in()

    def _take_in(self) -> None:
        """Hand on what came, in order; what must be restored first stops the rest."""
        while self._waiting and self._restoring is None:
            frame = self._waiting.popleft()
            if frame.coding is Coding.JPEG:
                self._restoring = self._loop.create_task(self._restore(frame))
            else:
                self._hand_on(frame)

    async def _restore(self, frame: Frame) -> None:
        try:
            if self.producer.kind != "image" or not frame.pieces:
                raise WorkerFailed(Problem("JPEG_INVALID", "only images come as JPEG"))
            data = b"".join(frame.pieces)
            pixels = await asyncio.to_thread(jpeg.restored, frame.header, data)
            self._hand_on(replace(frame, pieces=(pixels,)))
        except NondumError as error:
            self._stop(error.problems[0])
        finally:
            self._restoring = None
        self._take_in()

    def _hand_on(self, frame: Frame) -> None:
        try:
            header = _by_our_clock(frame.header, self._incoming.clocks.ahead_s)
            bulk = self.producer.joined(frame.pieces) if frame.pieces else None
            self.producer.send(message_from_wire(self.producer.kind, header, bulk))
        except NondumError as error:
            self._stop(error.problems[0])
            return
        except OSError as error:  # no memory left for a slot: the next frame may find some
            log.warning("a frame of another host was dropped: %s", error)
        self._incoming.handled(frame.seq)

    def _stop(self, problem: Problem) -> None:
        if not self.opened.done():
            self.opened.set_exception(WorkerFailed(problem))
            self.opened.exception()  # mark as seen: perhaps no caller waits
            self.close()
        else:
            self.close()
            self._on_over(problem)


def _by_our_clock(header: Mapping[str, Any], ahead_s: float) -> Mapping[str, Any]:
    """A message's header with its stamp on this host's clock, if the owner's is `ahead_s` ahead."""
    match header:
        case {"header": {"stamp_s": float(stamp_s)} as stamped} if ahead_s:
            return {**header, "header": {**stamped, "stamp_s": stamp_s - ahead_s}}
    return header
