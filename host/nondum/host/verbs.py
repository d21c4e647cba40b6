"""The verbs of the control socket: questions and orders of all kinds, by name."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from nondum.host.control.arguments import Arguments
from nondum.host.control.server import Follow, Verb
from nondum.host.core.row import Row
from nondum.sdk.errors import ConfigRefused, Problem

if TYPE_CHECKING:  # its import costs ten megabytes, which hosts without peers need not pay
    from nondum.host.peers.peer_services import PeerServices

T = TypeVar("T")

PEER_VERBS = (
    "peers",
    "peers_certify",
    "peers_confirm",
    "peers_forget",
    "peers_key",
    "peers_refuse",
    "peers_revoke",
    "peers_trust",
    "peers_trust_fleet",
    "peers_why",
    "place",
    "places",
)
"""What a host without peers refuses to answer, and why."""


class Answers(Protocol):
    """Questions or orders of one kind."""

    def answering(self) -> Mapping[str, Callable[[Arguments], Awaitable[Any]]]:
        """Their verbs that answer once."""
        ...


class Follows(Protocol):
    """The same, where some of them go on answering."""

    def following(self) -> Mapping[str, Callable[[Arguments], AsyncIterator[Any]]]:
        """Their verbs that go on answering."""
        ...


def answering(*parts: Answers, peers: PeerServices | None) -> dict[str, Verb]:
    """Verbs that answer once."""
    verbs = _together(part.answering() for part in parts)
    verbs |= peers.answering() if peers else dict.fromkeys(PEER_VERBS, _no_peers)
    return {name: _parsing(verb) for name, verb in verbs.items()}


def following(*parts: Follows, peers: PeerServices | None) -> dict[str, Follow]:
    """Verbs that go on answering."""
    verbs = _together(part.following() for part in parts)
    verbs |= peers.following() if peers else {"peers_pair": _no_peers_to_follow}
    return {name: _parsing(verb) for name, verb in verbs.items()}


def _together(tables: Iterable[Mapping[str, T]]) -> dict[str, T]:
    """One table of all."""
    return {name: verb for table in tables for name, verb in table.items()}


async def _no_peers(arguments: Arguments) -> Any:
    """Answer for a host that has nothing to do with others. Raises `ConfigRefused` (PEERS_OFF)."""
    told = "this host has nothing to do with others"
    raise ConfigRefused(Problem("PEERS_OFF", told, fix="set `enabled = true` under [peers]"))


async def _no_peers_to_follow(arguments: Arguments) -> AsyncIterator[Row]:
    yield await _no_peers(arguments)


def _parsing(verb: Callable[[Arguments], Any]) -> Callable[[Mapping[str, Any]], Any]:
    """The verb, given its arguments as they travel."""
    return lambda given: verb(Arguments(given))
