"""Peers that say whatever a test wants."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import zmq
from tests.transport.peers.hosts import Host

from nondum.transport.peers import Identity
from nondum.transport.peers.messages import Hello, encode


@contextlib.contextmanager
def raw_dealer(
    there: Host, me: Identity, *, routing_id: bytes = b""
) -> Iterator[zmq.Socket[bytes]]:
    """A peer that says whatever the test wants."""
    assert me.keys is not None
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    with context.socket(zmq.DEALER) as sock:
        sock.linger = 0
        sock.curve_publickey = me.keys.public.encode("ascii")
        sock.curve_secretkey = me.keys.secret.encode("ascii")
        sock.curve_serverkey = there.key.encode("ascii")
        if routing_id:
            sock.routing_id = routing_id
        try:
            sock.connect(there.address)
            yield sock
        finally:
            context.destroy(linger=0)


def hello_of(me: Identity, versions: tuple[int, ...] = (1,)) -> bytes:
    return encode(Hello(versions, me.name, me.key, 7, 1, me.certificate))
