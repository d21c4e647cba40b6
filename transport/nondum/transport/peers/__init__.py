"""Hosts among each other: keys and trust, pairing, and calls over authenticated links."""

from nondum.transport.peers.calls import Call
from nondum.transport.peers.events import DialFailed, LinksFailed, Loss, PeerEvent, PeerLost, PeerUp
from nondum.transport.peers.failures import CallFailed, PeerRefused, PeerUnreachable
from nondum.transport.peers.identity import Identity, Security
from nondum.transport.peers.incoming_calls import Handler, IncomingCall, Lease
from nondum.transport.peers.keys import HostKeys, PeerKey, fingerprint, load_or_create
from nondum.transport.peers.local_sockets import LocalSockets
from nondum.transport.peers.node import PeerNode
from nondum.transport.peers.refusals import Reason, Refusal, Refusals
from nondum.transport.peers.trust import Admission, Trust

__all__ = [
    "Admission",
    "Call",
    "CallFailed",
    "DialFailed",
    "Handler",
    "HostKeys",
    "Identity",
    "IncomingCall",
    "Lease",
    "LinksFailed",
    "LocalSockets",
    "Loss",
    "PeerEvent",
    "PeerKey",
    "PeerLost",
    "PeerNode",
    "PeerRefused",
    "PeerUnreachable",
    "PeerUp",
    "Reason",
    "Refusal",
    "Refusals",
    "Security",
    "Trust",
    "fingerprint",
    "load_or_create",
]
