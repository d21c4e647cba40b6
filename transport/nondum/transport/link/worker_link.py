"""The host's end of a worker's link. The socket is the worker's identity: there is no other.

What comes from a worker is a stranger's: it is decoded within strict limits, at a bounded rate, and
whatever breaks the protocol closes the link.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.link import Link, OnEvent, Pending
from nondum.sdk.packets import Handle, SocketPackets, discard
from nondum.sdk.wire import MAX_PACKET, PROTOCOL_VERSIONS, Body, Hello
from nondum.transport.link.metered import MeteredPackets


def link_sockets() -> tuple[socket.socket, socket.socket]:
    """Make the two ends of a link: the host's and the worker's. The caller closes both."""
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


class WorkerLink:
    """Requests, replies and events between the host and one worker. `close` it."""

    def __init__(
        self,
        sock: socket.socket,
        *,
        on_event: OnEvent,
        on_closed: Callable[[], None],
        on_violation: Callable[[ProtocolViolation], None],
        on_crowded: Callable[[], None] = lambda: None,
    ) -> None:
        """Own `sock` and begin to read, on the running loop.

        `on_event(name, body, call_id)` may raise `ProtocolViolation`. `on_closed` is called once
        when the worker is gone, and after `on_violation` when it broke the protocol; not after
        `close`. `on_crowded`: see `SocketPackets`.
        """
        self._on_closed, self._on_violation = on_closed, on_violation
        packets = MeteredPackets(SocketPackets(sock, MAX_PACKET, on_crowded=on_crowded))
        self._link = Link(packets, self._refuse, on_event, on_closed, on_violation)

    @property
    def is_closed(self) -> bool:
        """Whether nothing can be sent any more."""
        return self._link.is_closed

    async def meet(self, welcome: Body) -> Hello:
        """Wait for the worker's Hello, agree on a version, and send it the welcome.

        Raises `ProtocolViolation` (PROTO_VERSION, HANDSHAKE), `LinkClosed`.
        """
        hello = await self._link.hello()
        self._link.welcome(agreed_version(hello), welcome)
        return hello

    async def request(self, verb: str, body: Body, fds: Sequence[Handle] = ()) -> dict[str, Any]:
        """Ask the worker and wait; being cancelled cancels the request there. `fds` stay yours.

        Raises `WorkerFailed` with the worker's problems, `LinkClosed`, or `ProtocolViolation` when
        the body cannot be sent.
        """
        return await self._link.request(verb, body, fds)

    def begin(self, verb: str, body: Body, fds: Sequence[Handle] = ()) -> Pending:
        """Ask the worker without waiting; the call's id is known at once.

        Raises `LinkClosed`, or `ProtocolViolation` (NO_CREDIT, or when the body cannot be sent).
        """
        return self._link.begin(verb, body, fds)

    def cancel(self, call_id: int) -> None:
        """Ask the worker to halt a request; unknown and finished ones are ignored."""
        self._link.cancel(call_id)

    def tell(self, name: str, body: Body) -> None:
        """Send an event; silent once the link is closed.

        Raises `ProtocolViolation` when the body cannot be sent.
        """
        self._link.send_event(name, body)

    def close(self) -> None:
        """Close this end: own requests fail with `LinkClosed`."""
        self._link.close()

    async def _refuse(
        self, verb: str, _body: dict[str, Any], handles: tuple[Handle, ...], _id: int
    ) -> NoReturn:
        discard(handles)
        violation = ProtocolViolation(
            Problem("REQUEST_UNASKED", f"a worker asks nothing of its host, but this: {verb!r}")
        )
        if not self._link.is_closed:
            self._link.close()
            self._on_violation(violation)
            self._on_closed()
        raise violation


def agreed_version(hello: Hello) -> int:
    """The newest protocol version that both ends speak.

    >>> agreed_version(Hello(versions=(2, 1), sdk="0.2", pid=7))
    1

    Raises `ProtocolViolation` (PROTO_VERSION).
    """
    common = set(hello.versions) & set(PROTOCOL_VERSIONS)
    if not common:
        is_older = max(hello.versions) < max(PROTOCOL_VERSIONS)
        rebuild = "build the payload again with the SDK that belongs to the host"
        raise ProtocolViolation(
            Problem(
                "PROTO_VERSION",
                f"the worker's nondum-sdk {hello.sdk} speaks no version of the link that this "
                "host speaks",
                need=" or ".join(map(str, PROTOCOL_VERSIONS)),
                have=", ".join(map(str, hello.versions)),
                fix=rebuild if is_older else "update nondum on this host",
            )
        )
    return max(common)
