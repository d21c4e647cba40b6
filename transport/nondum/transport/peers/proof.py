"""The proof that a socket turns strangers away, before it is bound where some can come from."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from enum import Enum

import zmq

from nondum.sdk.errors import Problem
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import HostKeys
from nondum.transport.peers.listener import dialling
from nondum.transport.peers.monitor import SocketEvent, Watch
from nondum.transport.peers.suspicion import Awake

ANSWERED_S = 3.0
"""How long an answer is waited for: time in which this host's own loop stands still is none."""
TICK_S = 0.1
TRIES = 3
"""Probes that are sent while connections end unanswered: ZeroMQ gives handshakes up by the clock,
however little this process could run meanwhile."""


class Answer(Enum):
    """What became of a probe's connection."""

    TURNED_AWAY = "as it must be"
    LET_IN = "the handler was not asked, or lets all in"
    ENDED = "it has ended before an answer"
    NONE = "no answer comes"


_KINDS: dict[int, Answer] = {
    zmq.EVENT_HANDSHAKE_FAILED_AUTH: Answer.TURNED_AWAY,
    zmq.EVENT_HANDSHAKE_SUCCEEDED: Answer.LET_IN,
    zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL: Answer.ENDED,
    zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL: Answer.ENDED,
    zmq.EVENT_DISCONNECTED: Answer.ENDED,
    zmq.EVENT_CLOSED: Answer.ENDED,
}


async def prove_enforced(
    socket: zmq.Socket[bytes], keys: HostKeys | None, expect: Callable[[str], None]
) -> None:
    """Dial a socket that is not bound yet, with a key that the handler must turn away.

    `expect` tells the handler the key. Raises `PeerRefused` (ZAP_INEFFECTIVE) when the connection
    was let in, or not answered: then the socket must not be bound.
    """
    socket.bind("tcp://127.0.0.1:*")
    address = socket.getsockopt(zmq.LAST_ENDPOINT)
    assert isinstance(address, bytes)
    try:
        answer = Answer.ENDED
        for _ in range(TRIES):
            if answer is Answer.ENDED:
                answer = await _probed(socket.context, address.decode("ascii"), keys, expect)
    finally:
        socket.unbind(address)
    if answer is not Answer.TURNED_AWAY:
        raise PeerRefused(
            Problem(
                "ZAP_INEFFECTIVE",
                "a key that must be turned away was let in, or the key was not checked: "
                "this host will not listen to peers",
                fix="look for another ZeroMQ authenticator in this process",
            )
        )


async def _probed(
    context: zmq.Context[zmq.Socket[bytes]],
    address: str,
    keys: HostKeys | None,
    expect: Callable[[str], None],
) -> Answer:
    """Dial once, under a key of this moment."""
    own = HostKeys.generate() if keys else None
    expect(own.public if own else "")
    answered: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()

    def on_event(event: SocketEvent) -> None:
        if event.kind in _KINDS and not answered.done():
            answered.set_result(_KINDS[event.kind])

    with contextlib.ExitStack() as taken:
        probe = dialling(context, own, keys.public if keys else None)
        taken.callback(probe.close, 0)
        taken.callback(Watch(probe, on_event).close)
        probe.connect(address)
        return await _while_awake(answered)


async def _while_awake(answered: asyncio.Future[Answer]) -> Answer:
    loop = asyncio.get_running_loop()
    awake = Awake(loop.time(), longest_s=TICK_S)
    while not answered.done() and awake.seconds < ANSWERED_S:
        await asyncio.wait([answered], timeout=TICK_S)
        awake = awake.look(loop.time())
    return answered.result() if answered.done() else Answer.NONE
