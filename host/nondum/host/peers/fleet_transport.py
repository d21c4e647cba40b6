"""By which fleet this host reaches others, as it is configured: links to each, or a router."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from nondum.host.config.host_config import HostConfig, PeersSection
from nondum.host.peers.finder import PeerFinder
from nondum.host.peers.links.process import LinksProcess
from nondum.transport.discovery import interfaces as network
from nondum.transport.fleet import FleetEvent, Mesh
from nondum.transport.peers import Handler, Identity, LocalSockets, Trust
from nondum.transport.peers.socket_process.sockets import SocketProcess

if TYPE_CHECKING:  # zenoh is an extra
    from nondum.transport.fleet.zenoh import ZenohFleet

_APART = functools.partial(SocketProcess, start=LinksProcess)
ON_LOOPBACK = ("tcp://127.0.0.1:0",)


def fleet_of(
    config: HostConfig,
    identity: Identity,
    trust: Trust,
    handler: Handler,
    *,
    on_event: Callable[[FleetEvent], None],
    find: Callable[[Mesh], PeerFinder],
) -> Mesh | ZenohFleet:
    """The other hosts, not started yet. Raises `PeerRefused`."""
    router = config.router
    if not router.endpoints:
        return Mesh(
            identity,
            trust,
            handler,
            on_event=on_event,
            listen=listens(config.peers),
            find=find,
            sockets=_APART if config.peers.process else LocalSockets,
        )
    from nondum.transport.fleet.zenoh import ZenohFleet
    from nondum.transport.fleet.zenoh_line import RouterAccess

    access = RouterAccess(
        router.fleet,
        router.endpoints,
        router.authorities,
        router.certificate,
        router.private_key,
    )
    return ZenohFleet(identity, trust, handler, access, on_event=on_event)


def listens(config: PeersSection) -> tuple[str, ...]:
    """Where this host listens: without keys, on this machine only."""
    is_default = config.listen == PeersSection().listen
    return ON_LOOPBACK if config.development and is_default else config.listen


def own_hosts(config: HostConfig) -> Iterator[str]:
    """Where this host's streams can be fetched, as it is started; links tell that by themselves."""
    if config.router.endpoints:
        every = network.read()
        local = config.peers.development
        for one in network.loopback(every) if local else network.looked_on(every):
            yield from one.hosts
