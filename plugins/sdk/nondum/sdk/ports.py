"""The ends of streams inside a worker: output slots that say when they flow, and inputs.

Ports belong to the worker and outlive behaviours; a behaviour reaches them through its context.
Everything here runs on the loop.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from nondum.sdk.errors import MessageInvalid, NondumError, ProtocolViolation
from nondum.sdk.messages import MESSAGES, Message
from nondum.sdk.pace import STALL_S, Pace
from nondum.sdk.packets import Packets
from nondum.sdk.streams import Consumer, Producer

FRESH_S = 0.3
"""A message older than this is not what a newly opened input begins with."""

log = logging.getLogger(__name__)


class OutputPort:
    """An output slot: the producer of one stream object."""

    def __init__(self, stream: str, kind: str, on_flow: Callable[[OutputPort], None]) -> None:
        self.stream = stream
        """The stream's object name."""
        self.producer = Producer(kind)
        self.sent = 0
        """The number of messages so far, whether a consumer took them or not."""
        self._message_class = MESSAGES[kind]
        self._on_flow = on_flow
        self._users = 0
        self._opened_s = 0.0
        self._pace: Pace | None = None
        """None: nothing has come since it was opened."""
        self._watch: asyncio.TimerHandle | None = None

    @property
    def is_flowing(self) -> bool:
        """Whether messages have been sent, and none is overdue."""
        return self._watch is not None

    def send(self, message: Message) -> None:
        """Hand a message to all consumers (see `Producer.send`).

        Raises `TypeError` for a message of another type, `MessageInvalid` for wrong values.
        """
        if type(message) is not self._message_class:
            raise TypeError(
                f"{self.stream} carries {self._message_class.__name__}, "
                f"not {type(message).__name__}"
            )
        self.producer.send(message)
        self.sent += 1
        loop = asyncio.get_running_loop()
        now_s = loop.time()
        if self._pace is not None:
            self._pace = self._pace.after(now_s)
        else:
            took_s = now_s - self._opened_s if self._users else 0.0
            self._pace = Pace(now_s, first_took_s=took_s)
        if self._watch is None:
            self._watch = loop.call_later(STALL_S, self._look)
            self._on_flow(self)

    def open(self) -> None:
        """Count one more user."""
        if not self._users:
            self._opened_s = asyncio.get_running_loop().time()
        self._users += 1

    def release(self) -> None:
        """Count one user less; the stream ends with the last one."""
        self._users -= 1
        if not self._users:
            self._end_flow()
            self._pace = None  # who uses it next may have another one

    def close(self) -> None:
        """End the stream and drop its consumers."""
        self._end_flow()
        self.producer.close()

    def _look(self) -> None:
        loop = asyncio.get_running_loop()
        left_s = self._pace.overdue_s - loop.time() if self._pace is not None else 0.0
        if left_s <= 0:
            self._end_flow()
        else:  # the pace may quicken meanwhile
            self._watch = loop.call_later(min(left_s, STALL_S), self._look)

    def _end_flow(self) -> None:
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None
            self._on_flow(self)


class InputPort:
    """An input: whatever stream is wired to it now, if any."""

    def __init__(self) -> None:
        self.arrivals = 0
        """Messages that have arrived so far, whether taken or not."""
        self._arrived_s = 0.0
        self._stream = ""
        self._consumer: Consumer | None = None
        self._newest: Message | None = None
        self._has_refused = False
        """Whether it was told already that the producer sends what is no message of its type."""
        self._waiters: set[asyncio.Future[None]] = set()

    @property
    def stream(self) -> str:
        """Object name of the stream that is wired now; empty when there is none."""
        return self._stream if self._consumer is not None else ""

    def connect(self, stream: str, kind: str, packets: Packets) -> None:
        """Wire a stream, in place of the one before; owns `packets`."""
        self.disconnect()
        self._stream, self._has_refused = stream, False
        self._consumer = Consumer(kind, packets, self._on_message, self._on_closed)

    def disconnect(self) -> None:
        """Unwire; what has arrived is forgotten."""
        if self._consumer is not None:
            self._consumer.close()
        self._consumer = self._newest = None

    def newest(self) -> Message | None:
        """The last message that arrived, taken out of its slot once; a wrong one is passed over."""
        if self._consumer is not None:
            try:
                self._newest = self._consumer.take() or self._newest
            except MessageInvalid as error:  # it alone is left out
                if not self._has_refused:
                    log.warning("stream %s: message refused: %s", self._stream, error)
                self._has_refused = True
            except NondumError as error:
                log.warning("stream %s: message refused: %s", self._stream, error)
                self.disconnect()
        return self._newest

    def seen_by_newcomers(self) -> int:
        """Where a newly opened input begins to count: with a message that is fresh, or after it."""
        is_fresh = asyncio.get_running_loop().time() - self._arrived_s < FRESH_S
        return self.arrivals - 1 if self.arrivals and is_fresh else self.arrivals

    async def arrival(self) -> None:
        """Wait for one more message to arrive."""
        waiter: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiters.add(waiter)
        try:
            await waiter
        finally:
            self._waiters.discard(waiter)

    def _on_message(self) -> None:
        self.arrivals += 1
        self._arrived_s = asyncio.get_running_loop().time()
        for waiter in self._waiters:
            if not waiter.done():
                waiter.set_result(None)

    def _on_closed(self, violation: ProtocolViolation | None) -> None:
        if violation is not None:
            log.warning("stream %s: its producer broke the protocol: %s", self._stream, violation)
            self._newest = None
        else:
            self.newest()  # the last message of a stream that has ended may still be read
        self._consumer = None
