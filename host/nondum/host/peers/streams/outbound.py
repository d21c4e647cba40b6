"""A stream of this host on its way to one reader on another: newest wins, as the link bears."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from nondum.host.peers.streams import jpeg
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation
from nondum.sdk.messages import Buffer, Image, Message
from nondum.sdk.packets import Packets
from nondum.sdk.streams import Consumer
from nondum.transport.peers.keys import PeerKey
from nondum.transport.streams import Coding, Exporter, Fidelity
from nondum.transport.streams.packets import MAX_BULK

log = logging.getLogger(__name__)


class Outbound:
    """One more consumer of a stream, and the way to its reader. `end` it."""

    def __init__(
        self,
        exporter: Exporter,
        token: str,
        reader: PeerKey,
        kind: str,
        packets: Packets,
        on_over: Callable[[Problem], None],
    ) -> None:
        """Own `packets`. `on_over` is called once when either end is gone; not after `end`."""
        self.token, self.reader = token, reader
        self._on_over = on_over
        self._loop = asyncio.get_running_loop()
        self._fidelity = Fidelity(self._loop.time())
        self._compressing: asyncio.Task[None] | None = None
        self._coding = Coding.RAW
        """Of the last message that was sent."""
        self._waits = False
        """A message has arrived that was not taken yet."""
        self._is_claimed = False
        self._is_warned = False
        self._outgoing = exporter.grant(
            token, reader, kind, self._on_can_send, self._on_reader_gone
        )
        self._consumer = Consumer(kind, packets, self._on_message, self._on_producer_gone)

    def figures(self) -> dict[str, Any]:
        """What was sent so far, and how the last of it travelled."""
        outgoing = self._outgoing
        return {
            "frames": outgoing.frames_sent,
            "bytes": outgoing.bytes_sent,
            "coding": self._coding.name.lower(),
        }

    def end(self, problem: Problem) -> None:
        """Let go of both ends, and tell the reader why."""
        self._consumer.close()
        self._outgoing.end(problem)
        if self._compressing is not None:
            self._compressing.cancel()

    def _on_message(self) -> None:
        if self._waits and self._is_claimed and not self._outgoing.can_send:
            self._fidelity.dropped(self._loop.time())
        self._waits = True
        self._send()

    def _on_can_send(self) -> None:
        if not self._is_claimed:  # a reader gets what comes from now on, like any other
            self._is_claimed, self._waits = True, False
        self._send()

    def _send(self) -> None:
        if not self._waits or self._compressing is not None or not self._outgoing.can_send:
            return
        self._waits = False
        try:
            message = self._consumer.take()
            if message is not None:
                self._send_message(message)
        except NondumError as error:
            self._stop(error.problems[0])

    def _send_message(self, message: Message) -> None:
        is_jpeg = self._fidelity.coding is Coding.JPEG
        if is_jpeg and isinstance(message, Image) and jpeg.is_compressible(message.encoding):
            self._compressing = self._loop.create_task(self._compress(message))
        else:
            self._hand_over(Coding.RAW, *message.to_wire())

    async def _compress(self, image: Image) -> None:
        try:
            header, data = await asyncio.to_thread(jpeg.compressed, image)
            self._hand_over(Coding.JPEG, header, data)
        except Exception as error:
            log.exception("an image cannot be compressed")
            self._stop(Problem("JPEG_FAILED", f"{type(error).__name__}: {error}"[:200]))
        finally:
            self._compressing = None
        self._send()

    def _hand_over(self, coding: Coding, header: dict[str, Any], bulk: Buffer | None) -> None:
        if not self._outgoing.can_send:
            return  # its reader went while it was compressed
        length = 0 if bulk is None else memoryview(bulk).nbytes
        try:
            if length > MAX_BULK:
                raise ProtocolViolation(Problem("MESSAGE_TOO_LONG", f"{length} bytes"))
            self._outgoing.send(coding, header, bulk)
            self._coding = coding
        except ProtocolViolation as violation:
            if not self._is_warned:  # once is enough
                self._is_warned = True
                log.warning("messages too long for other hosts are left out: %s", violation)
        self._fidelity.sent(self._loop.time())

    def _on_reader_gone(self, problem: Problem) -> None:
        self._consumer.close()
        self._on_over(problem)

    def _on_producer_gone(self, violation: ProtocolViolation | None) -> None:
        if violation is not None:
            self._stop(violation.problems[0])
        else:
            self._stop(Problem("STREAM_ENDED", "its producer is gone"))

    def _stop(self, problem: Problem) -> None:
        if not self._outgoing.is_over:
            self.end(problem)
            self._on_over(problem)
