"""Hosts of the demonstration's fleet accept each other, and no other host accepts them."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime
from pathlib import Path

import pytest
from demo.search.fleet import Fleet

from nondum.host.peers.trust_store import PeerTrustStore
from nondum.transport.peers import PeerRefused, certificate


def opened(name: str, state: Path) -> PeerTrustStore:
    return asyncio.run(PeerTrustStore.open(state / "peers", name))


def admit(host: PeerTrustStore, other: PeerTrustStore) -> None:
    """As a host does with what another one shows it."""
    assert other.certificate is not None
    certificate.verify(other.certificate, host.trust.fleets, datetime.now(UTC))


def test_hosts_of_a_fleet_are_certified_for_each_other(tmp_path: Path) -> None:
    fleet = Fleet(tmp_path / "fleet")
    for name in ("rover", "mule"):
        fleet.admit(name, tmp_path / name)
    rover, mule = (opened(name, tmp_path / name) for name in ("rover", "mule"))
    assert (rover.warnings, mule.warnings) == ((), ())
    assert rover.key != mule.key
    admit(rover, mule)
    admit(mule, rover)


def test_host_of_another_fleet_stays_out(tmp_path: Path) -> None:
    Fleet(tmp_path / "fleet").admit("rover", tmp_path / "rover")
    Fleet(tmp_path / "another").admit("mule", tmp_path / "mule")
    with pytest.raises(PeerRefused, match="CERTIFICATE_FLEET"):
        admit(opened("rover", tmp_path / "rover"), opened("mule", tmp_path / "mule"))
