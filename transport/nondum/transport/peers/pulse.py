"""What rides in every ping: how far a host's own account of itself has come."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from nondum.sdk.codec.checks import Bounds
from nondum.sdk.frozen import frozen
from nondum.sdk.wire_fields import Number
from nondum.transport.peers.keys import PeerKey

DIGEST_BYTES = 8


@frozen
class State:
    """Of what a host tells its peers about itself: enough to see whether anything was missed."""

    revision: Number
    """Counts up from 1 in one life of the host."""
    digest: Annotated[bytes, Bounds(DIGEST_BYTES, DIGEST_BYTES)]
    """Over all of it."""


def _nothing() -> None:
    return None


def _ignore(_peer: PeerKey, _state: State) -> None: ...


@frozen
class Pulse:
    """Callbacks of pings: `state` gives this host's state, `receive` takes in a peer's."""

    state: Callable[[], State | None] = _nothing
    receive: Callable[[PeerKey, State], None] = _ignore
