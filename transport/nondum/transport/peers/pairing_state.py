"""How a pairing stands, as people are shown it."""

from __future__ import annotations

from typing import TypeAlias

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.keys import PeerKey, fingerprint


@frozen
class Idle:
    """No window was opened yet."""


@frozen
class Waiting:
    """This host can be paired, and no code is known yet."""

    tries_left: int
    problem: Problem | None = None
    """What became of the last try; before there was one, of the last address that was dialled."""


@frozen
class Comparing:
    """A code is shown: the people must see the same one on the other host."""

    code: str
    name: str
    """What the other host calls itself."""
    key: PeerKey
    is_confirmed: bool = False
    """Whether the person here has said yes, and only the one there has not."""

    @property
    def fingerprint(self) -> str:
        """The other host's key, for people."""
        return fingerprint(self.key)


@frozen
class Agreed:
    """Both people said yes: the host to trust."""

    key: PeerKey
    name: str


@frozen
class Failed:
    """No host was paired, and the window is closed."""

    problem: Problem


PairingState: TypeAlias = Idle | Waiting | Comparing | Agreed | Failed
