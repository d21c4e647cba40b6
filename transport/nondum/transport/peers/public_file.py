"""Public keys as people carry them: one line of ASCII, `KIND KEY NAME`. Nothing in it is secret.

    nondum-host@1 PUBLIC-CURVE-KEY rover-1
    nondum-fleet@1 PUBLIC-ED25519-KEY survey

A person who accepts one has compared its fingerprint, or got the file from a person they trust.
"""

from __future__ import annotations

import base64
import binascii

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.certificate import FleetKey, check_name
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey, parse_key

MAX_BYTES = 512
_HOST, _FLEET = "nondum-host@1", "nondum-fleet@1"


@frozen
class HostPublic:
    """A host's key, and what it is called."""

    key: PeerKey
    name: str

    def to_text(self) -> str:
        """The file."""
        return f"{_HOST} {self.key} {self.name}\n"


@frozen
class FleetPublic:
    """A fleet's key, and what its owner calls it."""

    key: FleetKey
    name: str

    def to_text(self) -> str:
        """The file."""
        return f"{_FLEET} {self.key} {self.name}\n"


def parse_host(text: str, where: str = "") -> HostPublic:
    """Read a host's public file. Raises `PeerRefused` (FILE_MALFORMED, KEY_MALFORMED, HOST_NAME).

    >>> parse_host("nondum-host@1 rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7 rover").name
    'rover'
    """
    key, name = _fields(text, _HOST, where)
    return HostPublic(parse_key(key), name)


def parse_fleet(text: str, where: str = "") -> FleetPublic:
    """Read a fleet's public file. Raises `PeerRefused` (FILE_MALFORMED, KEY_MALFORMED, HOST_NAME).

    >>> parse_fleet("nondum-fleet@1 AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA= survey").name
    'survey'
    """
    key, name = _fields(text, _FLEET, where)
    return FleetPublic(parse_fleet_key(key, where), name)


def parse_fleet_key(text: str, where: str = "") -> FleetKey:
    """Read a fleet's public key, in its one form. Raises `PeerRefused` (KEY_MALFORMED)."""
    try:
        raw = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        raw = b""
    if len(raw) != 32 or base64.b64encode(raw).decode("ascii") != text:
        told = "a fleet's public key is 32 bytes of base64"
        raise PeerRefused(Problem("KEY_MALFORMED", told, where=where))
    return FleetKey(text)


def _fields(text: str, kind: str, where: str) -> tuple[str, str]:
    parts = text[:MAX_BYTES].split()
    if len(parts) != 3 or parts[0] != kind:
        raise PeerRefused(
            Problem(
                "FILE_MALFORMED",
                f"it is not one line `{kind} KEY NAME`",
                where=where,
                fix="see `nondum peers key --help` and `nondum keys fleet new --help`",
            )
        )
    return parts[1], check_name(parts[2], where)
