"""What is kept of peers: who is there, and what they offer now."""

from __future__ import annotations

from nondum.host.core.events.peers import PeerJoined, PeerLeft, PeerShared
from nondum.host.core.records.peer import PeerRecord
from nondum.host.core.state import HostState
from nondum.host.lifecycle.turn import Turn


def on_peer_joined(turn: Turn, event: PeerJoined) -> None:
    """Enter a peer that offers nothing yet."""
    turn.events.append(event)
    peer = PeerRecord(event.key, event.host, event.address, event.admitted_by, event.life)
    turn.put_peer(peer)


def on_peer_shared(turn: Turn, event: PeerShared) -> None:
    """Take over what a peer offers; what it offers no more is withdrawn."""
    known = turn.state.peers.get(event.peer.key)
    if known is not None and known != event.peer:
        turn.events.append(event)
        turn.put_peer(event.peer)


def on_peer_left(turn: Turn, event: PeerLeft) -> None:
    """Withdraw all that a peer offered."""
    if event.key in turn.state.peers:
        turn.events.append(event)
        turn.drop_peer(event.key)


def offers(state: HostState) -> dict[str, tuple[object, ...]]:
    """What planning and behaviours go by of peers."""
    return {key: (peer.components, peer.mounts) for key, peer in state.peers.items()}
