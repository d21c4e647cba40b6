"""Hosts that begin to listen with few descriptors left, in a process that ZeroMQ may abort.

python -m tests.transport.peers.scarcity pairing LEFT…     # or: links LEFT…; a line each
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Mapping, Sequence
from typing import NoReturn, Protocol

from tests.kit.descriptors import descriptors_left
from tests.transport.peers.hosts import identity

from nondum.transport.peers import PeerRefused, Trust
from nondum.transport.peers.local_sockets import LocalSockets
from nondum.transport.peers.pairing_channel import PairingHost
from nondum.transport.peers.sockets import Owner

ADDRESS = "tcp://127.0.0.1:*"
OPENED = "opened"


class Listens(Protocol):
    """Listens with `left` descriptors left, and ends; tells the outcome."""

    async def __call__(self, left: int) -> str: ...


async def pairing(left: int) -> str:
    """A window in which a host can be paired."""
    with descriptors_left(left):
        host = PairingHost(identity("rover"), lambda _: None)
        try:
            host.open(ADDRESS)
            told = OPENED
        except PeerRefused as refused:
            told = refused.code
    await host.close()
    return told


async def links(left: int) -> str:
    """The sockets of a host's links."""
    owner = Owner(_unexpected_connection, lambda _: None, lambda _: None, lambda: 0.0)
    with descriptors_left(left):
        sockets = LocalSockets(identity("rover"), Trust(), owner)
        try:
            await sockets.listen([ADDRESS])
            told = OPENED
        except PeerRefused as refused:
            told = refused.code
    await sockets.close()
    return told


KINDS: Mapping[str, Listens] = {"pairing": pairing, "links": links}


def _unexpected_connection(*_: object) -> NoReturn:
    raise AssertionError("no test connects to this address")


async def _main(listens: Listens, lefts: Sequence[str]) -> None:
    for left in lefts:
        sys.stdout.write(f"{left} {await listens(int(left))}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    asyncio.run(_main(KINDS[sys.argv[1]], sys.argv[2:]))
