"""Files of a fleet and of keys that people carry."""

from __future__ import annotations

import base64
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from nondum.transport.peers import PeerKey, PeerRefused, fleet_files, private_file
from nondum.transport.peers.certificate import verify
from nondum.transport.peers.public_file import (
    FleetPublic,
    HostPublic,
    parse_fleet,
    parse_fleet_key,
    parse_host,
)

HOST = HostPublic(PeerKey("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7"), "rover")
FLEET = FleetPublic(parse_fleet_key("A" * 43 + "="), "survey")
NOW = datetime(2026, 6, 1, tzinfo=UTC)


def test_public_files_survive() -> None:
    assert parse_host(HOST.to_text()) == HOST
    assert parse_fleet(FLEET.to_text()) == FLEET


@pytest.mark.parametrize(
    ("parse", "text", "code"),
    [
        (parse_host, "", "FILE_MALFORMED"),
        (parse_host, f"nondum-host@1 {HOST.key}", "FILE_MALFORMED"),
        (parse_host, f"nondum-host@1 {HOST.key} rover more", "FILE_MALFORMED"),
        (parse_host, f"nondum-host@2 {HOST.key} rover", "FILE_MALFORMED"),
        (parse_host, f"nondum-fleet@1 {HOST.key} rover", "FILE_MALFORMED"),
        (parse_host, "nondum-host@1 key rover", "KEY_MALFORMED"),
        (parse_host, f"nondum-host@1 {HOST.key} Rover", "HOST_NAME"),
        (parse_fleet, f"nondum-host@1 {FLEET.key} survey", "FILE_MALFORMED"),
        (parse_fleet, f"nondum-fleet@1 {HOST.key} survey", "KEY_MALFORMED"),
    ],
    ids=range(9),
)
def test_malformed_public_file_is_refused(
    parse: Callable[[str], object], text: str, code: str
) -> None:
    with pytest.raises(PeerRefused) as refused:
        parse(text)
    assert refused.value.code == code


@pytest.mark.parametrize(
    "text",
    [
        base64.b64encode(bytes(31)).decode(),
        base64.b64encode(bytes(33)).decode(),
        base64.b64encode(bytes(32)).decode().replace("A=", "B="),
        "no base64",
    ],
    ids=["short", "long", "other letters for the same bytes", "none"],
)
def test_fleet_key_has_one_text(text: str) -> None:
    with pytest.raises(PeerRefused, match="KEY_MALFORMED"):
        parse_fleet_key(text)


def test_fleet_certifies_hosts_and_is_made_once(tmp_path: Path) -> None:
    fleet = fleet_files.create(tmp_path / "fleet", "survey")
    certificate = fleet_files.sign(tmp_path / "fleet", HOST, now=NOW, days=30)
    verify(certificate, {fleet.key}, NOW)
    with pytest.raises(PeerRefused, match="FLEET_EXISTS"):
        fleet_files.create(tmp_path / "fleet", "survey")
    verify(fleet_files.sign(tmp_path / "fleet", HOST, now=NOW, days=30), {fleet.key}, NOW)


@pytest.mark.parametrize(
    "text",
    [
        f"nondum-fleet-key@2 {base64.b64encode(bytes(32)).decode()}",
        f"nondum-fleet-key@1 {base64.b64encode(bytes(31)).decode()}",
        "nondum-fleet-key@1 no base64",
    ],
    ids=["version", "short", "no base64"],
)
def test_malformed_secret_of_a_fleet_signs_nothing(tmp_path: Path, text: str) -> None:
    private_file.create(tmp_path / fleet_files.SECRET_NAME, text)
    with pytest.raises(PeerRefused, match="FILE_MALFORMED"):
        fleet_files.sign(tmp_path, HOST, now=NOW, days=30)
