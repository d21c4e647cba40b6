"""Who is here: this host, and the peers with what they offer. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from nondum.host.core.records.peer import PeerRecord
from nondum.host.people.answers import few, fitting, listed

_MOST = 3
"""How many names a list has."""


def hosts_here(host: str, peers: Iterable[PeerRecord]) -> str:
    """The hosts that share what is plugged into them.

    >>> hosts_here("rover", [])
    'I am rover, and no other host is here.'
    >>> hosts_here("rover", [PeerRecord("key", "mule", "address", "pairing", "life")])
    'I am rover, and mule is here.'
    """
    known = sorted(peers, key=lambda peer: peer.name)
    if not known:
        return f"I am {host}, and no other host is here."
    verb = "is" if len(known) == 1 else "are"
    each = ([f"{peer.name}{_with(peer)}" for peer in known], [peer.name for peer in known])
    ways = [*map(listed, each), f"{len(known)} other hosts"]
    return fitting(f"I am {host}, and {names} {verb} here" for names in ways)


def _with(peer: PeerRecord) -> str:
    names = [component.id.split("@")[0] for component in peer.components if component.is_ready]
    return f" with {few(names, _MOST)}" if names else ""
