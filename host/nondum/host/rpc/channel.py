"""A child's end of its link to the daemon: blocking, one request after the other.

It needs no event loop, which children would have to load.
"""

from __future__ import annotations

import contextlib
import os
import socket
import threading
from collections.abc import Callable
from typing import Any, TypeAlias

from nondum.host.rpc import outcomes
from nondum.sdk.errors import NondumError
from nondum.sdk.pieces import Joined, cut
from nondum.sdk.wire import MAX_PACKET, Body, Event, Reply, Request, WireMessage, decode, encode

Tell: TypeAlias = Callable[[str, Body], None]
"""Tells an event of a request, by its name; any thread may."""
Do: TypeAlias = Callable[[str, Any, Tell], Any]
"""Carries out a request, by its verb and what it is about."""


def conversation() -> socket.socket:
    """The socket that came as descriptor 0. Neither what prints from now on nor what is started
    takes part in the conversation."""
    taken = socket.socket(fileno=os.dup(0))
    os.dup2(1, 0)
    os.dup2(2, 1)
    return taken


class Channel:
    """Messages over a socket, in pieces."""

    def __init__(self, sock: socket.socket, limit: int) -> None:
        """`limit`: bytes of a message."""
        self._sock, self._limit = sock, limit
        self._joined = Joined(limit)
        self._turn = threading.Lock()

    def serve(self, do: Do) -> None:
        """Carry out requests until the daemon is gone. A `NondumError` is answered.

        Raises `ProtocolViolation`.
        """
        with contextlib.suppress(ConnectionError):  # the daemon is gone and reads no answer
            while (message := self._received()) is not None:
                if isinstance(message, Request):
                    self._say(Reply(message.id, self._outcome(message, do)))

    def _outcome(self, request: Request, do: Do) -> Body:
        def tell(name: str, body: Body) -> None:
            self._say(Event(name, request.id, body))

        try:
            return outcomes.packed(do(request.verb, outcomes.unpacked(request.body), tell))
        except NondumError as error:
            return outcomes.refused(error)

    def _say(self, message: WireMessage) -> None:
        data = encode(message, self._limit)
        with self._turn:
            for packet in cut(data):
                self._sock.send(packet)

    def _received(self) -> WireMessage | None:
        """The next message; None when the other end is gone."""
        while packet := self._sock.recv(MAX_PACKET):
            if (data := self._joined.add(packet)) is not None:
                return decode(data, self._limit)
        return None
