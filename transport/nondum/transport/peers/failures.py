"""What goes wrong between hosts, as leaves of the one tree in `nondum.sdk.errors`.

NondumError
├── HostUnreachable
│   └── PeerUnreachable   no link to the peer, or it was lost while it was needed
├── PeerRefused           a key, certificate, pairing or setting that cannot be trusted
└── CallFailed            the peer answered a call with problems
"""

from __future__ import annotations

from nondum.sdk.errors import HostUnreachable, NondumError


class PeerUnreachable(HostUnreachable):
    """There is no link to the peer, or it was lost while it was needed."""


class PeerRefused(NondumError):
    """A key, certificate, pairing or setting that cannot be trusted."""


class CallFailed(NondumError):
    """The peer answered a call with problems, or not in time."""
