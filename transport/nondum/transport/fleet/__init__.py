"""The other hosts, however reached: who is there, what they tell of themselves, and calls."""

from nondum.transport.fleet.failures import EntryRefused
from nondum.transport.fleet.fleet import Fleet, FleetEvent, Peer, PeerChanged
from nondum.transport.fleet.mesh import Find, Finder, Mesh

__all__ = [
    "EntryRefused",
    "Find",
    "Finder",
    "Fleet",
    "FleetEvent",
    "Mesh",
    "Peer",
    "PeerChanged",
]
