"""`nondum doctor network`, as a person reads it."""

from __future__ import annotations

import json
import socket

from tests.host.cli.daemon import nondum


def test_every_finding_has_its_place_in_the_table() -> None:
    done = nondum("doctor", "network")
    assert done.out.splitlines()[0].split() == ["RESULT", "CHECK", "INTERFACE", "DETAIL"]
    assert "firewall" in done.out
    assert "UDP port 5353 (multicast), and UDP and TCP port 7410" in done.out


def test_what_is_bad_is_told_with_its_own_exit_code() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = nondum("doctor", "network", "--json", "--port", str(port))
    told = json.loads(done.out)
    (found,) = (one for one in told["findings"] if one["check"] == f"TCP port {port}")
    assert (done.code, told["ok"], found["result"]) == (3, False, "bad")
    assert "peers.listen" in found["fix"]
