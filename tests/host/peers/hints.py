"""What the network tells of hosts, without a network."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from nondum.host.peers.trust_store import PeerTrustStore
from nondum.transport.peers import PeerKey


@dataclass(frozen=True)
class Hinted:
    """What the network tells of a host."""

    key: PeerKey
    name: str
    addresses: tuple[str, ...]
    pairing_port: int | None


@dataclass
class Network:
    """Who has told what."""

    hints: dict[PeerKey, Hinted] = field(default_factory=dict)

    def all(self) -> Iterable[Hinted]:
        return list(self.hints.values())

    def tells(self, trust_store: PeerTrustStore) -> Callable[[int | None], None]:
        def announce(port: int | None) -> None:
            at = ("tcp://127.0.0.1:7410", "tcp://[::1]:7410")
            self.hints[trust_store.key] = Hinted(trust_store.key, trust_store.host.name, at, port)

        return announce
