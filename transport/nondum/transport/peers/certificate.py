"""What lets a host into a fleet: a name and a key, signed by the fleet. Source: RFC 8032 (Ed25519).

The form, on a drive and in a hello, is seven lines of ASCII; the signature covers the first six,
each with its line feed. Nothing else may stand in it, so that one certificate has one form:

    nondum-host-certificate@1
    fleet: FLEET KEY, base64
    host: rover-1
    key: PUBLIC CURVE KEY, Z85
    not-before: 2026-01-01T00:00:00Z
    not-after: 2027-01-01T00:00:00Z
    signature: 64 BYTES, base64
"""

from __future__ import annotations

import base64
import re
from collections.abc import Container
from dataclasses import replace
from datetime import UTC, datetime
from typing import NewType

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.ed25519 import SigningKey, is_signed
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey, parse_key

FleetKey = NewType("FleetKey", str)
"""A fleet's public Ed25519 key, base64."""

MAX_BYTES = 1024
SKEW_S = 300.0
"""How far two hosts' clocks may be apart."""
HOST_NAME = re.compile(r"[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?")
"""As in DNS (RFC 1123), lower case."""

_HEADER = "nondum-host-certificate@1"
_FIELDS = ("fleet", "host", "key", "not-before", "not-after", "signature")
_TIME = "%Y-%m-%dT%H:%M:%SZ"


@frozen
class Certificate:
    """The fleet says: this key is this host's, from then until then."""

    fleet: FleetKey
    host: str
    key: PeerKey
    not_before: datetime
    not_after: datetime
    signature: bytes = b""

    def signed_bytes(self) -> bytes:
        """What the signature covers."""
        lines = [
            _HEADER,
            f"fleet: {self.fleet}",
            f"host: {self.host}",
            f"key: {self.key}",
            f"not-before: {self.not_before.strftime(_TIME)}",
            f"not-after: {self.not_after.strftime(_TIME)}",
        ]
        return "".join(f"{line}\n" for line in lines).encode("ascii")

    def to_bytes(self) -> bytes:
        """The whole of it, as `parse` reads it."""
        signature = base64.b64encode(self.signature).decode("ascii")
        return self.signed_bytes() + f"signature: {signature}\n".encode("ascii")


def new_fleet() -> tuple[FleetKey, bytes]:
    """Make a fleet's key pair: the public one, and the 32 bytes to be kept secret."""
    made = SigningKey.generate()
    return _fleet_key(made), made.secret


def issue(
    secret: bytes, host: str, key: PeerKey, *, not_before: datetime, not_after: datetime
) -> Certificate:
    """Sign a certificate with a fleet's secret key. Times are aware, and kept in whole seconds.

    Raises `PeerRefused` (HOST_NAME, KEY_MALFORMED, CERTIFICATE_VALIDITY).
    """
    signer = SigningKey.of(secret)
    unsigned = Certificate(
        _fleet_key(signer), host, parse_key(key), _second(not_before), _second(not_after)
    )
    _check(unsigned)
    return replace(unsigned, signature=signer.sign(unsigned.signed_bytes()))


def parse(data: bytes) -> Certificate:
    """Read a certificate; its signature and times are not looked at (see `verify`).

    Raises `PeerRefused` (CERTIFICATE_MALFORMED, HOST_NAME, KEY_MALFORMED, CERTIFICATE_VALIDITY).
    """
    if len(data) > MAX_BYTES:
        raise _malformed(f"it is longer than {MAX_BYTES} bytes")
    try:
        header, *lines = data.decode("ascii").split("\n")
        names = tuple(line.partition(": ")[0] for line in lines)
        if header != _HEADER or names != (*_FIELDS, ""):
            raise _malformed(f"it is not {_HEADER} with {', '.join(_FIELDS)}")
        fleet, host, key, begins, ends, signature = (line.partition(": ")[2] for line in lines[:-1])
        found = Certificate(
            FleetKey(fleet),
            host,
            parse_key(key),
            _time(begins),
            _time(ends),
            base64.b64decode(signature, validate=True),
        )
        canonical = found.to_bytes()
    except ValueError as error:
        raise _malformed(f"{type(error).__name__}: {error}") from error
    if canonical != data:
        raise _malformed("it is not written in the one form that it has")
    _check(found)
    return found


def verify(found: Certificate, fleets: Container[FleetKey], now: datetime) -> None:
    """Check that a trusted fleet signed it and that it holds now.

    Raises `PeerRefused` (CERTIFICATE_FLEET, CERTIFICATE_SIGNATURE, CERTIFICATE_TIME).
    """
    if found.fleet not in fleets:
        raise PeerRefused(
            Problem(
                "CERTIFICATE_FLEET",
                "it is signed by a fleet that this host does not belong to",
                where=found.host,
                have=found.fleet,
                fix="have the host's certificate issued by this fleet, or pair the two hosts",
            )
        )
    unsigned = Problem("CERTIFICATE_SIGNATURE", "the fleet did not sign this", where=found.host)
    try:
        public = base64.b64decode(found.fleet)
        is_by_fleet = is_signed(found.signed_bytes(), found.signature, public)
    except ValueError as error:
        raise PeerRefused(unsigned) from error
    if not is_by_fleet:
        raise PeerRefused(unsigned)
    _check_time(found, now)


def check_name(name: str, where: str = "") -> str:
    """The name, if hosts and fleets may have it. Raises `PeerRefused` (HOST_NAME)."""
    if not HOST_NAME.fullmatch(name):
        told = "a name has up to 63 of a-z, 0-9 and -, with no - at the ends"
        raise PeerRefused(Problem("HOST_NAME", told, where=where, have=repr(name)))
    return name


def _check_time(found: Certificate, now: datetime) -> None:
    early = (found.not_before - now).total_seconds() > SKEW_S
    late = (now - found.not_after).total_seconds() > SKEW_S
    if early or late:
        raise PeerRefused(
            Problem(
                "CERTIFICATE_TIME",
                "it is not valid yet" if early else "it is not valid any more",
                where=found.host,
                need=f"{found.not_before:{_TIME}} to {found.not_after:{_TIME}}",
                have=f"{now.astimezone(UTC):{_TIME}}",
                fix="look at this host's clock, then have the certificate issued again",
            )
        )


def _check(found: Certificate) -> None:
    check_name(found.host)
    if found.not_after <= found.not_before:
        raise PeerRefused(
            Problem("CERTIFICATE_VALIDITY", "it ends before it begins", where=found.host)
        )


def _time(text: str) -> datetime:
    return datetime.strptime(text, _TIME).replace(tzinfo=UTC)


def _second(moment: datetime) -> datetime:
    return moment.astimezone(UTC).replace(microsecond=0)


def _fleet_key(signer: SigningKey) -> FleetKey:
    return FleetKey(base64.b64encode(signer.public).decode("ascii"))


def _malformed(what: str) -> PeerRefused:
    return PeerRefused(Problem("CERTIFICATE_MALFORMED", f"no certificate: {what}"))
