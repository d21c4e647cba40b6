"""What is kept of peers: who is there, and what they offer now."""

from __future__ import annotations

from nondum.host.events import PeerLeft, PeerShared
from nondum.host.lifecycle.turn import Turn


def on_peer_shared(turn: Turn, event: PeerShared) -> None:
    """Take over what a peer offers; what it offers no more is withdrawn."""
    if turn.state.peers.get(event.peer.key) != event.peer:
        turn.events.append(event)
        turn.put_peer(event.peer)


def on_peer_left(turn: Turn, event: PeerLeft) -> None:
    """Withdraw all that a peer offered."""
    if event.key in turn.state.peers:
        turn.events.append(event)
        turn.drop_peer(event.key)
