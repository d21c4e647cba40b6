"""What happens between hosts, in past tense."""

from __future__ import annotations

from enum import Enum
from typing import TypeAlias

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.refusals import Refusal


class Loss(Enum):
    """Why a peer is no longer there."""

    DEPARTED = "it said goodbye"
    SILENT = "nothing was heard of it: the host hangs, or the network is gone"
    DISCONNECTED = "the connection broke and did not come back: the process ended"
    RESTARTED = "it has restarted"
    GAVE_UP = "it had given up the link itself"
    TURNED_AWAY = "it does not accept this host any more"
    REVOKED = "its key is not accepted any more"
    EXPIRED = "its certificate has ended"
    VIOLATED = "it broke the protocol"
    CLOSED = "this host has closed its links"


@frozen
class PeerUp:
    """A peer can be called."""

    key: PeerKey
    name: str
    epoch: int
    address: str
    admitted_by: str


@frozen
class PeerLost:
    """A peer cannot be called any more; calls to it have failed."""

    key: PeerKey
    name: str
    reason: Loss


@frozen
class DialFailed:
    """An address did not lead to the peer; told again only when the reason changes."""

    key: PeerKey
    address: str
    problem: Problem


@frozen
class LinksFailed:
    """All links broke at once, for a fault of this host's; they come back by themselves."""

    problem: Problem


PeerEvent: TypeAlias = PeerUp | PeerLost | DialFailed | Refusal | LinksFailed
