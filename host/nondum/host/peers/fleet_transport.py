"""By which fleet this host reaches others: links to each, or what an extension brings."""

from __future__ import annotations

import functools
from collections.abc import Iterator

from nondum.host.config.host_config import HostConfig, PeersSection
from nondum.host.extension.hookspecs import FleetMember, MakeFleet
from nondum.host.extension.loading import Extensions
from nondum.host.peers.links.process import LinksProcess
from nondum.sdk.errors import Problem
from nondum.transport.discovery import interfaces as network
from nondum.transport.fleet import Mesh
from nondum.transport.peers import LocalSockets, PeerRefused
from nondum.transport.peers.socket_process.sockets import SocketProcess

_APART = functools.partial(SocketProcess, start=LinksProcess)
ON_LOOPBACK = ("tcp://127.0.0.1:0",)


def linked(config: PeersSection, member: FleetMember) -> Mesh:
    """A link to each other host; not started yet."""
    return Mesh(
        member.identity,
        member.trust,
        member.handler,
        on_event=member.on_event,
        listen=listens(config),
        find=member.find,
        sockets=_APART if config.process else LocalSockets,
    )


def chosen(extensions: Extensions, config: HostConfig) -> MakeFleet:
    """The one way to reach other hosts that extensions have for this configuration.

    Raises `PeerRefused` (FLEET_AMBIGUOUS, ZENOH_MISSING).
    """
    found: list[tuple[str, MakeFleet]] = list(extensions.asked("fleets", config=config))
    if len(found) == 1:
        return found[0][1]
    if found:
        text = "more than one extension would reach this host's peers"
        have = ", ".join(name for name, _ in found)
        raise PeerRefused(Problem("FLEET_AMBIGUOUS", text, have=have))
    text = "a Zenoh router is named, and no extension of this host uses one"
    fix = "pip install 'nondum[zenoh]'"
    missing = Problem("ZENOH_MISSING", text, where="router.endpoints", fix=fix)
    raise PeerRefused(missing, *extensions.problems)


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
