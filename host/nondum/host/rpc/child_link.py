"""The daemon's end of the link to one of its children."""

from __future__ import annotations

import socket
from collections.abc import Callable
from typing import Any, NoReturn, TypeAlias

from nondum.host.rpc import outcomes
from nondum.sdk.errors import LinkClosed, Problem, ProtocolViolation
from nondum.sdk.link import Link
from nondum.sdk.packets import Handle, SocketPackets
from nondum.sdk.wire import MAX_PACKET, Body

OnNews: TypeAlias = Callable[[str, Body], None]
"""Told the events of a request, by their names. May raise `ProtocolViolation`."""


class ChildLink:
    """Requests to one child, which does one at a time. What a child reads may take it over: it can
    answer wrongly, and break this link. `close` it."""

    def __init__(self, sock: socket.socket, limit: int) -> None:
        """Own `sock` and begin to read, on the running loop. `limit`: bytes of a message.

        Raises `OSError` when it cannot be watched; then `sock` is still the caller's.
        """
        self._on_news: OnNews | None = None
        self._violation: ProtocolViolation | None = None
        self._link = Link(
            SocketPackets(sock, MAX_PACKET, max_handles=0),
            self._refuse,
            self._on_event,
            lambda: None,
            self._on_violation,
            credit=1,
            limit=limit,
        )

    async def ask(self, verb: str, value: Any, on_news: OnNews | None = None) -> Body:
        """Ask about a value; the reply, of which `outcomes.unpacked` has the result. Events are for
        `on_news`; without it, there are to be none.

        Being cancelled does not stop the child, which hears nothing meanwhile: kill it. Raises
        `LinkClosed` when it has ended, `ProtocolViolation` when it broke the protocol.
        """
        self._on_news = on_news
        try:
            return await self._link.request(verb, outcomes.packed(value))
        except LinkClosed:
            if self._violation is not None:
                raise self._violation from None
            raise
        finally:
            self._on_news = None

    def close(self) -> None:
        """Close this end; the child ends once it listens again."""
        self._link.close()

    def _on_event(self, name: str, body: dict[str, Any], _call_id: int | None) -> None:
        if self._on_news is None:
            raise ProtocolViolation(Problem("EVENT_UNKNOWN", f"a child tells {name!r} unasked"))
        self._on_news(name, body)

    def _on_violation(self, violation: ProtocolViolation) -> None:
        self._violation = violation

    async def _refuse(
        self, verb: str, _body: dict[str, Any], _handles: tuple[Handle, ...], _id: int
    ) -> NoReturn:
        told = f"a child asks nothing of its daemon, but this: {verb!r}"
        self._violation = ProtocolViolation(Problem("REQUEST_UNASKED", told))
        self._link.close()
        raise self._violation
