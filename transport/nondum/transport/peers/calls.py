"""Calls that this host has made to one peer and that are not answered yet."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Generator
from typing import Any, TypeAlias

from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.failures import CallFailed, PeerUnreachable
from nondum.transport.peers.messages import Cancel, Message, Request, encode, milliseconds

CREDIT = 256
"""Calls to one peer that may be unanswered."""
PROGRESS_KEPT = 64
"""Reports of one call that wait to be read; the oldest is dropped for a new one."""

Send: TypeAlias = Callable[[bytes], Sent]


class Call:
    """A call on its way: await it for the answer, or iterate over its progress first.

    Awaiting raises `CallFailed` with the peer's problems (or DEADLINE, HALTED), or
    `PeerUnreachable` (PEER_LOST). A task that is cancelled while it awaits cancels the call, so
    only one should.
    """

    def __init__(self, request: Request, ends_s: float, cancel: Callable[[int], None]) -> None:
        self.number = request.number
        self.request = request
        self.ends_s = ends_s
        """On the loop's clock."""
        self._cancel = cancel
        loop = asyncio.get_running_loop()
        self._outcome: asyncio.Future[dict[str, Any]] = loop.create_future()
        self._progress: deque[dict[str, Any]] = deque(maxlen=PROGRESS_KEPT)
        self._waiting: asyncio.Future[None] | None = None
        self.timer: asyncio.TimerHandle | None = None

    def __await__(self) -> Generator[Any, None, dict[str, Any]]:
        try:
            return (yield from self._outcome)  # no shield: it costs a turn of the loop
        except asyncio.CancelledError:
            self._cancel(self.number)
            raise

    async def __aiter__(self) -> AsyncIterator[dict[str, Any]]:
        while self._progress or not self._outcome.done():
            if self._progress:
                yield self._progress.popleft()
                continue
            self._waiting = asyncio.get_running_loop().create_future()
            await self._waiting

    def cancel(self) -> None:
        """Ask the peer to halt it; the answer is then HALTED. Nothing happens once it is done."""
        if not self._outcome.done():
            self._cancel(self.number)

    def report(self, body: dict[str, Any]) -> None:
        """Take a report of progress in."""
        self._progress.append(body)
        self._wake()

    def succeed(self, body: dict[str, Any]) -> None:
        """Settle it with an answer."""
        if not self._outcome.done():
            self._outcome.set_result(body)
        self._finish()

    def fail(self, error: NondumError) -> None:
        """Settle it with an error, which need not be fetched."""
        if not self._outcome.done():
            self._outcome.set_exception(error)
            self._outcome.exception()  # mark as seen: perhaps nothing awaits it
        self._finish()

    def _finish(self) -> None:
        if self.timer is not None:
            self.timer.cancel()
        self._wake()

    def _wake(self) -> None:
        if self._waiting is not None and not self._waiting.done():
            self._waiting.set_result(None)


class Calls:
    """All of them, in the order of their numbers."""

    def __init__(self, peer: str, send: Send, first: int) -> None:
        """`peer` is its name, for people; `first` the number of the first call."""
        self._peer, self._send = peer, send
        self._next = first
        self._loop = asyncio.get_running_loop()
        self._pending: dict[int, Call] = {}

    @property
    def next_number(self) -> int:
        """The number of the next call: no number comes twice in an epoch."""
        return self._next

    def begin(self, method: str, args: Body, deadline_s: float) -> Call:
        """Make a call.

        Raises `PeerUnreachable` (PEER_BUSY) when the peer takes no more now, `ProtocolViolation`
        and `TypeError` for what cannot be sent: nothing was sent then.
        """
        if len(self._pending) >= CREDIT:
            raise self._busy(f"{CREDIT} calls are unanswered")
        ends_s = self._loop.time() + deadline_s
        call = Call(self._request(self._next, method, args, deadline_s), ends_s, self.cancel)
        if self._send(encode(call.request)) is Sent.FULL:
            raise self._busy("as many messages wait as may")
        self._pending[self._next] = call
        self._next += 1
        call.timer = self._loop.call_at(ends_s, self._expire, call)
        return call

    def awaits(self, number: int) -> bool:
        """Whether a call is unanswered."""
        return number in self._pending

    def cancel(self, number: int) -> None:
        """Ask the peer to halt a call; unknown and finished ones are ignored."""
        if number in self._pending:
            self._tell(Cancel(number))

    def succeed(self, number: int, body: dict[str, Any]) -> None:
        """An answer came; an answer to a call that is over is ignored."""
        if call := self._pending.pop(number, None):
            call.succeed(body)

    def fail(self, number: int, problems: tuple[Problem, ...]) -> None:
        """A failure came."""
        if call := self._pending.pop(number, None):
            call.fail(CallFailed(*problems))

    def report(self, number: int, body: dict[str, Any]) -> None:
        """A report of progress came."""
        if call := self._pending.get(number):
            call.report(body)

    def repeat(self) -> None:
        """Send all again that are unanswered, over the link that came in place of a broken one."""
        now_s = self._loop.time()
        for call in self._pending.values():
            old = call.request
            self._tell(self._request(call.number, old.method, old.args, call.ends_s - now_s))

    def lose(self, problem: Problem) -> None:
        """The peer is gone: fail all."""
        pending, self._pending = self._pending, {}
        for call in pending.values():
            call.fail(PeerUnreachable(problem))

    def _request(self, number: int, method: str, args: Body, remaining_s: float) -> Request:
        settled = next(iter(self._pending), number)
        return Request(number, settled, milliseconds(remaining_s), method, args)

    def _expire(self, call: Call) -> None:
        self._tell(Cancel(call.number))
        self._pending.pop(call.number, None)
        call.fail(
            CallFailed(
                Problem("DEADLINE", "no answer came in time", where=self._told(call.request))
            )
        )

    def _told(self, request: Request) -> str:
        return f"{self._peer}: {request.method}"

    def _tell(self, message: Message) -> None:
        """Send what may be lost: the deadline ends a call that was not repeated or cancelled."""
        self._send(encode(message))

    def _busy(self, why: str) -> PeerUnreachable:
        return PeerUnreachable(
            Problem("PEER_BUSY", f"the peer takes no more calls now: {why}", where=self._peer)
        )
