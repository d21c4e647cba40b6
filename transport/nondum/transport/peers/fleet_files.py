"""A fleet, as its owner keeps it: a folder with a secret key, which no host ever has, and a public
one.

    fleet.key   nondum-fleet-key@1 SECRET-ED25519-KEY, base64; mode 0600
    fleet.pub   see `public_file`
"""

from __future__ import annotations

import base64
import binascii
from datetime import datetime, timedelta
from pathlib import Path

from nondum.sdk.errors import Problem
from nondum.transport.peers import certificate as certificates
from nondum.transport.peers import private_file
from nondum.transport.peers.certificate import SKEW_S, Certificate
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.public_file import FleetPublic, HostPublic

SECRET_NAME = "fleet.key"
PUBLIC_NAME = "fleet.pub"
_HEADER = "nondum-fleet-key@1"


def create(folder: Path, name: str) -> FleetPublic:
    """Make a fleet. Raises `PeerRefused` (FLEET_EXISTS, HOST_NAME), `OSError`."""
    key, secret = certificates.new_fleet()
    public = FleetPublic(key, certificates.check_name(name, str(folder)))
    try:
        private_file.create(
            folder / SECRET_NAME, f"{_HEADER} {base64.b64encode(secret).decode('ascii')}\n"
        )
    except FileExistsError as error:
        told = "there is a fleet's key already, and whatever it signed would be worth nothing"
        fix = "choose another folder"
        where = str(folder / SECRET_NAME)
        raise PeerRefused(Problem("FLEET_EXISTS", told, where=where, fix=fix)) from error
    (folder / PUBLIC_NAME).write_text(public.to_text(), encoding="ascii")
    return public


def sign(folder: Path, host: HostPublic, *, now: datetime, days: int) -> Certificate:
    """Certify a host for a number of days, from a little before `now` (clocks differ).

    Raises `PeerRefused` (FILE_OPEN_TO_OTHERS, FILE_MALFORMED, HOST_NAME, CERTIFICATE_VALIDITY),
    `OSError`.
    """
    begins, ends = now - timedelta(seconds=SKEW_S), now + timedelta(days=days)
    secret = _secret(folder / SECRET_NAME)
    return certificates.issue(secret, host.name, host.key, not_before=begins, not_after=ends)


def _secret(path: Path) -> bytes:
    header, _, text = private_file.read_secret(path).strip().partition(" ")
    try:
        secret = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        secret = b""
    if header != _HEADER or len(secret) != 32:
        told = f"it is not one line of `{_HEADER}`"
        raise PeerRefused(Problem("FILE_MALFORMED", told, where=str(path)))
    return secret
