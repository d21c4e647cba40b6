"""Which peers a host lets in, and why: by its fleets, by pairing, and never when revoked. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from datetime import datetime
from enum import Enum
from typing import TypeVar

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers import certificate as certificates
from nondum.transport.peers.certificate import FleetKey
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey, fingerprint

_Key = TypeVar("_Key", bound=str)


class TrustState(Enum):
    """What is known of a key before its owner has said a word."""

    ADMITTED = "admitted"
    """Paired."""
    MUST_CERTIFY = "must certify"
    """Unknown, but this host belongs to a fleet: its first message must carry a certificate."""
    UNKNOWN = "unknown"
    REVOKED = "revoked"


@frozen
class Admission:
    """A peer is let in."""

    key: PeerKey
    name: str
    by: str
    """`pairing`, `certificate`, or `development`."""
    until: datetime | None = None
    """When its certificate ends."""


@frozen
class Trust:
    """The keys that this host trusts. Every change makes a new value."""

    fleets: Mapping[FleetKey, str] = field(default_factory=dict)
    """Public key → what people call the fleet."""
    paired: Mapping[PeerKey, str] = field(default_factory=dict)
    """Key → name of the host."""
    revoked: Mapping[PeerKey, str] = field(default_factory=dict)
    """Key → why."""

    def with_fleet(self, fleet: FleetKey, name: str) -> Trust:
        """Let in every host that the fleet certifies."""
        return replace(self, fleets={**self.fleets, fleet: name})

    def with_paired(self, key: PeerKey, name: str) -> Trust:
        """Let in one host. Raises `PeerRefused` (KEY_REVOKED)."""
        if key in self.revoked:
            raise PeerRefused(self._revoked(key))
        return replace(self, paired={**self.paired, key: name})

    def with_revoked(self, key: PeerKey, why: str) -> Trust:
        """Never let in this key again, however it was admitted."""
        paired = {known: name for known, name in self.paired.items() if known != key}
        return replace(self, paired=paired, revoked={**self.revoked, key: why})

    def without(self, key: str) -> Trust:
        """Forget a paired host or a fleet, or that a key was revoked."""
        return Trust(
            _without(self.fleets, key), _without(self.paired, key), _without(self.revoked, key)
        )

    def state_of(self, key: PeerKey) -> TrustState:
        """The state of a key, without a certificate."""
        if key in self.revoked:
            return TrustState.REVOKED
        if key in self.paired:
            return TrustState.ADMITTED
        return TrustState.MUST_CERTIFY if self.fleets else TrustState.UNKNOWN

    def admit(self, key: PeerKey, certificate: bytes, now: datetime) -> Admission:
        """Let a peer in that has proved its key and shown a certificate, or none (empty).

        Raises `PeerRefused` (KEY_REVOKED, KEY_UNKNOWN, CERTIFICATE_…).
        """
        match self.state_of(key):
            case TrustState.REVOKED:
                raise PeerRefused(self._revoked(key))
            case TrustState.ADMITTED:
                return Admission(key, self.paired[key], "pairing")
            case TrustState.UNKNOWN:
                raise PeerRefused(_unknown(key))
        if not certificate:
            raise PeerRefused(_unknown(key))
        found = certificates.parse(certificate)
        certificates.verify(found, self.fleets, now)
        if found.key != key:
            raise PeerRefused(
                Problem(
                    "CERTIFICATE_KEY",
                    "the certificate is another host's: its key is not the one proved",
                    where=found.host,
                    need=fingerprint(found.key),
                    have=fingerprint(key),
                )
            )
        return Admission(key, found.host, "certificate", found.not_after)

    def _revoked(self, key: PeerKey) -> Problem:
        return Problem(
            "KEY_REVOKED", f"this key was revoked: {self.revoked[key]}", where=fingerprint(key)
        )


def _without(part: Mapping[_Key, str], key: str) -> dict[_Key, str]:
    return {known: told for known, told in part.items() if known != key}


def _unknown(key: PeerKey) -> Problem:
    return Problem(
        "KEY_UNKNOWN",
        "this host neither paired with the key nor knows a certificate of it",
        where=fingerprint(key),
        fix="pair the two hosts, or put a certificate of the fleet on the other one",
    )
