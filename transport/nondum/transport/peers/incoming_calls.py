"""Calls that a peer has made to this host and that are being carried out."""

from __future__ import annotations

import asyncio
import inspect
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from enum import Enum
from typing import Any, Protocol, TypeAlias

from nondum.sdk.errors import NondumError, Problem, ProtocolViolation
from nondum.sdk.wire import Body
from nondum.transport.peers.call_history import CallHistory, Seen
from nondum.transport.peers.calls import CREDIT, Send
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.events import Loss
from nondum.transport.peers.messages import Failure, Progress, Reply, Request, encode
from nondum.transport.peers.trust import Admission

log = logging.getLogger(__name__)


class Lease(Enum):
    """What becomes of a call whose caller is lost."""

    STOP = "stop"
    """It is cancelled at once."""
    HOLD = "hold"
    """It runs on without its deadline, told by `orphaned`, until it ends by itself or the host
    ends it."""
    FINISH = "finish"
    """It runs to its end, which its deadline still bounds."""


class IncomingCall:
    """One call from a peer, as the handler that carries it out sees it."""

    def __init__(
        self, caller: Admission, request: Request, report: Callable[[int, Body], None]
    ) -> None:
        self.caller = caller
        self.number = request.number
        self.method = request.method
        self.args = dict(request.args)
        self.orphaned = asyncio.Event()
        """Set when the caller is lost and the call is held or finished."""
        self.ends_s = asyncio.get_running_loop().time() + request.remaining_ms / 1000
        """Its deadline, on this host's loop's clock."""
        self._report = report
        self.task: asyncio.Task[None] | None = None
        self.timer: asyncio.TimerHandle | None = None
        self.is_late = False

    def progress(self, body: Body) -> None:
        """Tell the caller how far it is; lost when the caller cannot take it now.

        Raises `ProtocolViolation`, `TypeError` when it cannot be sent at all.
        """
        self._report(self.number, body)

    def halt(self) -> None:
        """Cancel it; the caller is told HALTED, or DEADLINE."""
        if self.task is not None:
            self.task.cancel()


class Handler(Protocol):
    """What a host does for its peers."""

    def serve(self, incoming: IncomingCall) -> Body | Awaitable[Body]:
        """Carry a call out; what it raises of `NondumError` is the answer then.

        An awaitable runs as a task, is cancelled when the caller asks for it, when the deadline
        passes, and, as `orphaned` decides, when the caller is lost.
        """

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None:
        """A peer tells something."""

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        """Decide what becomes of a running call whose caller is lost."""


Finished: TypeAlias = Reply | Failure


class IncomingCalls:
    """The running calls of one peer, and the history of its earlier ones."""

    def __init__(self, caller: Admission, once: CallHistory, handler: Handler, send: Send) -> None:
        self._caller, self._once, self._handler, self._send = caller, once, handler, send
        self._loop = asyncio.get_running_loop()
        self._running: dict[int, IncomingCall] = {}
        self._unsent: deque[int] = deque(maxlen=CREDIT)  # answers beyond are forgotten anyway

    def take(self, request: Request) -> None:
        """A call came, perhaps again: carry it out at most once."""
        self._once.settle(request.settled)
        match self._once.take(request.number):
            case Seen.NEW if len(self._running) >= CREDIT:
                self._conclude(_busy(request.number))
            case Seen.NEW:
                self._begin(request)
            case Seen.ANSWERED:
                self._pass_on(request.number)
            case Seen.FORGOTTEN:
                self._send(encode(_forgotten(request.number)))

    def cancel(self, number: int) -> None:
        """The caller wants a call halted; unknown and finished ones are ignored."""
        if incoming := self._running.get(number):
            incoming.halt()

    def pass_on_waiting(self) -> None:
        """Send the answers that could not be sent before."""
        for _ in range(len(self._unsent)):
            self._pass_on(self._unsent.popleft())

    def lose(self, reason: Loss) -> list[IncomingCall]:
        """The caller is lost: ask the handler about each call; the calls that run on."""
        kept = []
        self._send = _nowhere
        for incoming in list(self._running.values()):
            lease = self._lease(incoming, reason)
            if lease is Lease.STOP:
                incoming.halt()
                continue
            if lease is Lease.HOLD and incoming.timer is not None:
                incoming.timer.cancel()
            incoming.orphaned.set()
            kept.append(incoming)
        return kept

    def _lease(self, incoming: IncomingCall, reason: Loss) -> Lease:
        try:
            return self._handler.orphaned(incoming, reason)
        except Exception:
            log.exception(
                "the handler could not decide what becomes of %s: it is stopped", incoming.method
            )
            return Lease.STOP

    def _begin(self, request: Request) -> None:
        incoming = IncomingCall(self._caller, request, self._progress)
        try:
            result = self._handler.serve(incoming)
        except Exception as error:
            self._conclude(_failure(incoming, error))
            return
        if not inspect.isawaitable(result):
            self._conclude(Reply(request.number, result))
            return
        self._running[request.number] = incoming
        incoming.task = self._loop.create_task(self._work(incoming, result))
        incoming.task.add_done_callback(lambda _: self._end(incoming, result))
        incoming.timer = self._loop.call_at(incoming.ends_s, self._expire, incoming)

    async def _work(self, incoming: IncomingCall, result: Awaitable[Body]) -> None:
        try:
            answer: Finished = Reply(incoming.number, await result)
        except asyncio.CancelledError as error:
            answer = _failure(incoming, error)
        except Exception as error:
            answer = _failure(incoming, error)
        self._running.pop(incoming.number, None)
        self._conclude(answer)

    def _end(self, incoming: IncomingCall, result: Awaitable[Body]) -> None:
        if incoming.timer is not None:
            incoming.timer.cancel()
        if self._running.pop(incoming.number, None):  # cancelled before its first step
            if inspect.iscoroutine(result):
                result.close()
            self._conclude(_failure(incoming, asyncio.CancelledError()))

    def _expire(self, incoming: IncomingCall) -> None:
        incoming.is_late = True
        incoming.halt()

    def _conclude(self, answer: Finished) -> None:
        try:
            data = encode(answer)
        except (ProtocolViolation, TypeError) as unsendable:
            told = f"the answer cannot be sent: {unsendable}"[:1000]
            data = encode(Failure(answer.number, (Problem("ANSWER_UNSENDABLE", told),)))
        self._once.answered(answer.number, data)
        self._pass_on(answer.number)

    def _pass_on(self, number: int) -> None:
        try:
            answer = self._once.answer(number)
        except KeyError:
            answer = encode(_forgotten(number))
        if self._send(answer) is Sent.FULL:
            self._unsent.append(number)

    def _progress(self, number: int, body: Body) -> None:
        if number in self._running:
            self._send(encode(Progress(number, body)))


def _nowhere(_data: bytes) -> Sent:
    return Sent.GONE


def _failure(incoming: IncomingCall, error: BaseException) -> Failure:
    if isinstance(error, NondumError):
        return Failure(incoming.number, error.problems)
    if isinstance(error, asyncio.CancelledError):
        late = Problem("DEADLINE", "it took longer than the caller would wait")
        return Failure(incoming.number, (late if incoming.is_late else _HALTED,))
    log.error("%s failed for %s", incoming.method, incoming.caller.name, exc_info=error)
    told = f"{type(error).__name__}: {error}"[:1000]
    return Failure(incoming.number, (Problem("INTERNAL", told),))


_HALTED = Problem("HALTED", "halted as asked")


def _busy(number: int) -> Failure:
    return Failure(number, (Problem("PEER_BUSY", f"{CREDIT} calls are being carried out"),))


def _forgotten(number: int) -> Failure:
    told = "the call was carried out, or begun, but its answer is kept no more"
    return Failure(number, (Problem("ANSWER_FORGOTTEN", told),))
