"""All that can be looked at on one machine, in the order in which people should read it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from nondum.cli.examination import account, beliefs, clock, daemon, drives, machine, space
from nondum.cli.examination.finding import Finding, bad, ok
from nondum.host.config.effective import Asked, effective, file_of
from nondum.host.config.host_config import HostConfig
from nondum.host.workers import confinement_choice
from nondum.sdk.errors import ConfigRefused
from nondum.transport.discovery import doctor as network

USUAL_PORT = 7410
Examine = Callable[[HostConfig], Iterator[Finding]]


def examine(asked: Asked) -> Iterator[Finding]:
    """Look at everything, as the configuration that is `asked` for has it. Takes seconds.

    Where the file is wrong, the rest is looked at by the defaults.
    """
    try:
        config = effective(asked)
        file = file_of(asked)
        told = f"{file} is right" if file else "there is no file: all is as by default"
        yield ok("config", told)
    except ConfigRefused as refused:
        for problem in refused.problems:
            yield bad("config", str(problem), "correct it; `nondum config check` tells all at once")
        config = effective(Asked(is_user=True)) if asked.is_user else HostConfig()
    for look in PARTS:
        yield from look(config)


def confinement(config: HostConfig) -> Iterator[Finding]:
    """At which level workers would be confined."""
    try:
        confinement_state = confinement_choice.confinement_state(
            config.workers.confinement, config.workers.minimum_confinement
        )
    except ConfigRefused as refused:
        for problem in refused.problems:
            yield bad("confinement", str(problem), "see `nondum doctor confinement`")
        return
    yield ok("confinement", f"{confinement_state.level} ({confinement_state.mechanism})")


def discovery(config: HostConfig) -> Iterator[Finding]:
    """Whether other hosts can be found, where they are looked for."""
    if not config.peers.enabled:
        yield ok("network", "this host has nothing to do with others (`peers.enabled`)")
        return
    for found in network.examine(_port(config.peers.listen)):
        yield Finding(found.check, found.result, found.detail, found.fix, found.interface)


def _port(listen: Sequence[str]) -> int:
    """The first port that this host listens at; the usual one where it takes any."""
    ports = (address.rpartition(":")[2] for address in listen)
    return next((int(port) for port in ports if port.isdecimal() and int(port)), USUAL_PORT)


PARTS: tuple[Examine, ...] = (
    account.examine,
    daemon.examine,
    machine.examine,
    confinement,
    space.examine,
    drives.examine,
    clock.examine,
    beliefs.examine,
    discovery,
)
