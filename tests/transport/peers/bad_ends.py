"""Ends of links at which everything may be said."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import zmq
from tests.transport.peers.hosts import Host

from nondum.transport.peers import Identity
from nondum.transport.peers.messages import Hello, encode


@contextlib.contextmanager
def bad_dealer(
    address: str, me: Identity, there: Host, *, most_read: int = 1000
) -> Iterator[zmq.Socket[bytes]]:
    """A host that dials, and may send anything; it reads `most_read` messages unasked."""
    with bad_socket(zmq.DEALER, me) as bad:
        bad.rcvhwm = most_read
        bad.curve_serverkey = there.key.encode("ascii")
        bad.connect(address)
        yield bad


@contextlib.contextmanager
def bad_router(me: Identity) -> Iterator[tuple[zmq.Socket[bytes], str]]:
    """A host that is dialled, and may say everything; where it listens."""
    with bad_socket(zmq.ROUTER, me) as bad:
        bad.curve_server = True
        bad.bind("tcp://127.0.0.1:*")
        where = bad.getsockopt(zmq.LAST_ENDPOINT)
        assert isinstance(where, bytes)
        yield bad, where.rstrip(b"\0").decode("ascii")


@contextlib.contextmanager
def bad_socket(kind: int, me: Identity) -> Iterator[zmq.Socket[bytes]]:
    assert me.keys is not None
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    with context.socket(kind) as bad:
        bad.linger = 0
        bad.curve_publickey = me.keys.public.encode("ascii")
        bad.curve_secretkey = me.keys.secret.encode("ascii")
        try:
            yield bad
        finally:
            context.destroy(linger=0)


def greeting(me: Identity, term: int = 1) -> Hello:
    return Hello((1,), me.name, me.key, 7, term, me.certificate)


def hello_of(me: Identity, term: int = 1) -> bytes:
    return encode(greeting(me, term))
