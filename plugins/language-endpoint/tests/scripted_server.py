"""A server at a port of loopback that says what a test has it say, byte for byte."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

Reply = Callable[[socket.socket], None]
"""Answers one client, whose request has been read."""


@dataclass
class Scripted:
    """Where it listens, and what it was asked."""

    port: int = 0
    requests: list[bytes] = field(default_factory=list)
    is_over: threading.Event = field(default_factory=threading.Event)
    """Set when the test is: a reply without end ends then."""


@contextmanager
def scripted(
    reply: Callable[[Scripted], Reply], context: ssl.SSLContext | None = None
) -> Iterator[Scripted]:
    """Run one, each client in a thread, for as long as the block runs."""
    server = Scripted()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        server.port = listening.getsockname()[1]
        accepting = threading.Thread(target=_accept, args=(listening, server, reply, context))
        accepting.start()
        try:
            yield server
        finally:
            server.is_over.set()
            listening.shutdown(socket.SHUT_RDWR)
            accepting.join()


def _accept(
    listening: socket.socket,
    server: Scripted,
    reply: Callable[[Scripted], Reply],
    context: ssl.SSLContext | None,
) -> None:
    clients: list[threading.Thread] = []
    with suppress(OSError):  # it listens no longer
        while True:
            client, _ = listening.accept()
            serving = threading.Thread(target=_serve, args=(client, server, reply(server), context))
            serving.start()
            clients.append(serving)
    for serving in clients:
        serving.join()


def _serve(
    client: socket.socket, server: Scripted, reply: Reply, context: ssl.SSLContext | None
) -> None:
    with suppress(OSError), client:  # who asked may have gone
        secure = client if context is None else context.wrap_socket(client, server_side=True)
        with secure:
            server.requests.append(_request(secure))
            reply(secure)


def _request(client: socket.socket) -> bytes:
    said = b""
    while b"\r\n\r\n" not in said:
        said += _more(client)
    head, _, body = said.partition(b"\r\n\r\n")
    (length,) = (
        int(line[15:]) for line in head.split(b"\r\n") if line.startswith(b"Content-Length")
    )
    while len(body) < length:
        body += _more(client)
    return head + b"\r\n\r\n" + body


def _more(client: socket.socket) -> bytes:
    said = client.recv(65_536)
    if not said:
        raise ConnectionResetError
    return said
