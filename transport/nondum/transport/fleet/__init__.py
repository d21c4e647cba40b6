"""The other hosts, however reached: who is there, what they tell of themselves, and calls."""

from nondum.transport.fleet.failures import EntryRefused
from nondum.transport.fleet.mesh import Find, Finder, Mesh
from nondum.transport.fleet.seam import Fleet, FleetEvent, Peer, PeerChanged

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
