"""A worker link: requests, replies, events and cancellations between a host and one worker.

Both ends use it. Requests carry ids and are bounded by credits in each direction; events are
ordered with them; what cannot be sent at once waits in a bounded queue.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
import socket
from collections import deque
from collections.abc import Awaitable, Callable, Generator, Sequence
from typing import Any, TypeAlias

from nondum.sdk.errors import LinkClosed, NondumError, Problem, ProtocolViolation, WorkerFailed
from nondum.sdk.outbox import Outbox
from nondum.sdk.packets import Handle, Packets, SocketPackets, discard
from nondum.sdk.pieces import Joined, cut
from nondum.sdk.wire import (
    MAX_PACKET,
    Body,
    Cancel,
    Event,
    Failure,
    Hello,
    Reply,
    Request,
    Welcome,
    WireMessage,
    decode,
    encode,
)

CREDIT = 64
"""Requests that may be unanswered, in each direction."""
MAX_WAITING = 4096
"""Packets that wait for a slow other end before the link is given up."""
MAX_WAITING_BYTES = 4 * 1024 * 1024

OnRequest: TypeAlias = Callable[
    [str, dict[str, Any], tuple[Handle, ...], int], Awaitable[dict[str, Any]]
]
OnEvent: TypeAlias = Callable[[str, dict[str, Any], int | None], None]

log = logging.getLogger(__name__)


class Pending:
    """A request on its way: await it for the reply's body.

    Raises `WorkerFailed` with the problems of the other end (code HALTED after a cancellation), or
    `LinkClosed`.
    """

    def __init__(self, call_id: int) -> None:
        self.id = call_id
        """The call's id: the `call_id` of the events that belong to it."""
        self.outcome: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        """The reply or the error, for one waiter only; awaiting the call itself allows more."""

    def __await__(self) -> Generator[Any, None, dict[str, Any]]:
        return asyncio.shield(self.outcome).__await__()

    def succeed(self, body: dict[str, Any]) -> None:
        """Settle it with a reply."""
        if not self.outcome.done():
            self.outcome.set_result(body)

    def fail(self, error: NondumError) -> None:
        """Settle it with an error, which need not be fetched."""
        if not self.outcome.done():
            self.outcome.set_exception(error)
            self.outcome.exception()  # mark as seen: no task may be waiting


class Link:
    """One end of a worker link. Make it within a running loop; `close` it."""

    def __init__(
        self,
        sock: socket.socket | Packets,
        on_request: OnRequest,
        on_event: OnEvent,
        on_closed: Callable[[], None],
        on_violation: Callable[[ProtocolViolation], None],
        credit: int = CREDIT,
        *,
        max_handles: int = 0,
        limit: int = MAX_PACKET,
    ) -> None:
        """Own `sock` and begin to read.

        `on_request(verb, body, handles, call_id)` runs as a separate task, owns the handles, and
        answers with its result, its `NondumError`, or HALTED when it is cancelled.
        `on_event(name, body, call_id)` is called at once. `on_closed` is called once when the other
        end is gone, and after `on_violation` when it broke the protocol; not after `close`.
        A packet with more than `max_handles` descriptors is a violation, and a message of more than
        `limit` bytes. Where messages may be longer than a packet, all travel in pieces.
        """
        self._on_request, self._on_event = on_request, on_event
        self._on_closed, self._on_violation = on_closed, on_violation
        self._credit, self._free, self._max_handles = credit, credit, max_handles
        self._limit, self._joined = limit, Joined(limit) if limit > MAX_PACKET else None
        self._credit_waiters: deque[asyncio.Future[None]] = deque()
        self._ids = itertools.count(1)
        self._pending: dict[int, Pending] = {}
        self._running: dict[int, asyncio.Task[None]] = {}
        self._not_begun: dict[int, tuple[Handle, ...]] = {}
        """Requests whose tasks have not taken their first step, and their handles."""
        self._greeting: asyncio.Future[Hello | Welcome] = asyncio.get_running_loop().create_future()
        self.is_closed = False
        is_socket = isinstance(sock, socket.socket)
        self._packets: Packets = SocketPackets(sock, MAX_PACKET) if is_socket else sock  # type: ignore[assignment,arg-type]  # narrowed by is_socket
        self._outbox = Outbox(self._packets)
        self._packets.open(self._receive, self._lose)

    async def request(self, verb: str, body: Body, fds: Sequence[Handle] = ()) -> dict[str, Any]:
        """Ask the other end and wait for its reply; being cancelled cancels the request there.

        `fds` stay the caller's. Raises `WorkerFailed` with the other end's problems, `LinkClosed`,
        or `ProtocolViolation` when the body cannot be sent.
        """
        while not self._free and not self.is_closed:
            await self._turn()
        call = self.begin(verb, body, fds)
        try:
            return await call.outcome
        except asyncio.CancelledError:
            self.cancel(call.id)
            raise

    def begin(self, verb: str, body: Body, fds: Sequence[Handle] = ()) -> Pending:
        """Send a request without waiting; its id is known at once.

        Raises `LinkClosed`, or `ProtocolViolation` (NO_CREDIT, or when the body cannot be sent).
        """
        if self.is_closed:
            raise _closed()
        if not self._free:
            raise ProtocolViolation(
                Problem("NO_CREDIT", f"{self._credit} requests are unanswered already")
            )
        call = Pending(next(self._ids))
        self._send(Request(call.id, verb, body), tuple(fds))
        self._free -= 1
        self._pending[call.id] = call
        return call

    def cancel(self, call_id: int) -> None:
        """Ask the other end to halt a request; unknown and finished ones are ignored."""
        if call_id in self._pending and not self.is_closed:
            self._send(Cancel(call_id))

    def send_event(self, name: str, body: Body, call_id: int | None = None) -> None:
        """Tell the other end; silent once the link is closed.

        Raises `ProtocolViolation` when the body cannot be sent.
        """
        if not self.is_closed:
            self._send(Event(name, call_id, body))

    async def greet(self, hello: Hello) -> Welcome:
        """As a worker: say Hello and wait for the host's Welcome. Raises `LinkClosed`."""
        self._send(hello)
        answer = await self._greeting
        if not isinstance(answer, Welcome):
            raise ProtocolViolation(Problem("HANDSHAKE", "a host does not say Hello"))
        return answer

    async def hello(self) -> Hello:
        """As a host: wait for the worker's Hello. Raises `LinkClosed`, `ProtocolViolation`."""
        answer = await self._greeting
        if not isinstance(answer, Hello):
            raise ProtocolViolation(Problem("HANDSHAKE", "a worker does not say Welcome"))
        return answer

    def welcome(self, version: int, body: Body) -> None:
        """As a host: answer the Hello. Raises `ProtocolViolation` when the body cannot be sent."""
        self._send(Welcome(version, body))

    def close(self) -> None:
        """Close this end: what runs for the other end is cancelled, own requests fail."""
        if self.is_closed:
            return
        self.is_closed = True
        self._packets.close()
        for call_id in tuple(self._running):
            self._halt(call_id)
        for call in self._pending.values():
            call.fail(_closed())
        self._pending.clear()
        for turn in self._credit_waiters:
            if not turn.done():
                turn.set_result(None)
        if not self._greeting.done():
            self._greeting.set_exception(_closed())
            self._greeting.exception()  # mark as seen: no task may be waiting
        self._outbox.clear()

    def _send(self, message: WireMessage, handles: tuple[Handle, ...] = ()) -> None:
        data = encode(message, self._limit)
        if len(self._outbox) >= MAX_WAITING or self._outbox.bytes > MAX_WAITING_BYTES:
            told = f"{len(self._outbox)} packets wait to be read"
            self._violate(Problem("LINK_CONGESTED", told))
            return
        for packet in (data,) if self._joined is None else cut(data):
            self._outbox.send(packet, handles)

    def _receive(self, data: bytes, handles: tuple[Handle, ...]) -> None:
        try:
            if self._joined is not None:
                if (joined := self._joined.add(data)) is None:
                    discard(handles)
                    return
                data = joined
            message = decode(data, self._limit)
            if len(handles) > (self._max_handles if isinstance(message, Request) else 0):
                raise ProtocolViolation(
                    Problem("PACKET_DESCRIPTORS", "a packet carries unexpected descriptors")
                )
            self._dispatch(message, handles)
        except ProtocolViolation as violation:
            discard(handles)
            self._violate(*violation.problems)

    def _dispatch(self, message: WireMessage, handles: tuple[Handle, ...]) -> None:
        match message:
            case Reply(call_id, body):
                self._settle(call_id).succeed(dict(body))
            case Failure(call_id, problems):
                self._settle(call_id).fail(WorkerFailed(*problems))
            case Event(name, call_id, body):
                self._on_event(name, dict(body), call_id)
            case Request():
                self._serve(message, handles)
            case Cancel(call_id):
                if call_id in self._running:
                    self._halt(call_id)
            case Hello() | Welcome():
                if self._greeting.done():
                    raise ProtocolViolation(Problem("HANDSHAKE", "the handshake came twice"))
                self._greeting.set_result(message)

    def _settle(self, call_id: int) -> Pending:
        call = self._pending.pop(call_id, None)
        if call is None:
            raise ProtocolViolation(
                Problem("UNKNOWN_CALL", f"an answer to call {call_id}, which was never made")
            )
        self._free += 1
        self._next_turn()
        return call

    async def _turn(self) -> None:
        """Wait until a credit may be free."""
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._credit_waiters.append(turn)
        try:
            await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self._next_turn()  # it was this one's turn: hand it on
            raise

    def _next_turn(self) -> None:
        while self._credit_waiters:
            turn = self._credit_waiters.popleft()
            if not turn.done():
                turn.set_result(None)
                return

    def _serve(self, request: Request, handles: tuple[Handle, ...]) -> None:
        if request.id in self._running:
            raise ProtocolViolation(Problem("CALL_TWICE", f"call {request.id} runs already"))
        if len(self._running) >= self._credit:
            raise ProtocolViolation(
                Problem("NO_CREDIT", f"more than {self._credit} requests at once")
            )
        self._not_begun[request.id] = handles
        loop = asyncio.get_running_loop()
        self._running[request.id] = loop.create_task(self._work(request, handles))

    async def _work(self, request: Request, handles: tuple[Handle, ...]) -> None:
        """Carry a request out and answer it."""
        del self._not_begun[request.id]
        answer: Reply | Failure
        try:
            body = await self._on_request(request.verb, dict(request.body), handles, request.id)
            answer = Reply(request.id, body)
        except asyncio.CancelledError:
            answer = _halted(request.id)
        except NondumError as error:
            answer = Failure(request.id, error.problems)
        except Exception as error:
            log.exception("a request's handler failed")
            told = f"{type(error).__name__}: {error}"[:1000]
            answer = Failure(request.id, (Problem(_code_of(error), told),))
        self._answer(answer)

    def _halt(self, call_id: int) -> None:
        """Cancel a request; one that has not begun never will, so it is answered here."""
        self._running[call_id].cancel()
        if (handles := self._not_begun.pop(call_id, None)) is not None:
            discard(handles)
            self._answer(_halted(call_id))

    def _answer(self, answer: Reply | Failure) -> None:
        del self._running[answer.id]
        if self.is_closed:
            return
        try:
            self._send(answer)
        except (ProtocolViolation, TypeError) as unsendable:
            told = f"the answer cannot be sent: {unsendable}"[:1000]
            self._send(Failure(answer.id, (Problem("ANSWER_UNSENDABLE", told),)))

    def _violate(self, *problems: Problem) -> None:
        if not self.is_closed:
            self.close()
            self._on_violation(ProtocolViolation(*problems))
            self._on_closed()

    def _lose(self, violation: ProtocolViolation | None) -> None:
        if violation is not None:
            self._violate(*violation.problems)
        elif not self.is_closed:
            self.close()
            self._on_closed()


def _code_of(error: Exception) -> str:
    """The code of an error that is no `NondumError`; Python has no class for a missing thread."""
    is_short = isinstance(error, MemoryError) or "can't start new thread" in str(error)
    return "NO_MEMORY" if is_short else "INTERNAL"


def _halted(call_id: int) -> Failure:
    return Failure(call_id, (Problem("HALTED", "halted as asked"),))


def _closed() -> LinkClosed:
    return LinkClosed(Problem("LINK_CLOSED", "the other end of the worker link is gone"))
