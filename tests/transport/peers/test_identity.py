"""Which addresses a host may have peers at."""

from __future__ import annotations

import pytest

from nondum.transport.peers import HostKeys, Identity, PeerRefused
from nondum.transport.peers.identity import is_loopback

WITH_KEYS, WITHOUT = Identity("rover", HostKeys.generate()), Identity("rover", None)


@pytest.mark.parametrize("address", ["udp://127.0.0.1:1", "tcp://:1", "tcp://127.0.0.1:", "here"])
def test_address_has_a_host_and_a_port(address: str) -> None:
    for one in (WITH_KEYS, WITHOUT):
        with pytest.raises(PeerRefused, match="ADDRESS_MALFORMED"):
            one.check_address(address)


@pytest.mark.parametrize(
    "address", ["tcp://192.0.2.1:7410", "tcp://localhost:7410", "tcp://*:7410"]
)
def test_host_without_keys_has_peers_on_this_machine_only(address: str) -> None:
    WITH_KEYS.check_address(address)
    with pytest.raises(PeerRefused, match="DEVELOPMENT_LOOPBACK"):
        WITHOUT.check_address(address)


@pytest.mark.parametrize(
    ("host", "is_here"),
    [
        ("127.0.0.1", True),
        ("[::1]", True),
        ("::ffff:127.0.0.1", True),
        ("::ffff:192.0.2.1", False),
        ("192.0.2.1", False),
        ("localhost", False),
        ("", False),
    ],
)
def test_only_addresses_of_this_machine_are_loopback(host: str, is_here: bool) -> None:
    assert is_loopback(host) is is_here
