"""Two hosts that never met are introduced by their people, and parted again: whole daemons."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from tests.daemon.neighbours import looking, until_peer
from tests.kit.command_line import nondum
from tests.kit.running_host import RunningHost

from nondum.transport.peers import fingerprint
from nondum.transport.peers.keys import load_or_create

pytestmark = pytest.mark.daemon


def code_in(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    for line in process.stdout:
        row = json.loads(line)
        if row["step"] == "comparing":
            return str(row["code"])
    raise AssertionError("no code was shown")


def key_of(host: RunningHost) -> str:
    return fingerprint(load_or_create(host.state / "peers" / "host.key").public)


def test_hosts_are_paired_used_and_revoked(tmp_path: Path) -> None:
    with looking(tmp_path, "rover", "base") as (rover, base):
        window = ("peers", "pair", "--json")
        with rover.started(*window) as here, base.started(*window) as there:
            code = code_in(here)
            assert code_in(there) == code
            with base.started("peers", "pair", "--yes-code", code) as other:
                said = rover.run("peers", "pair", "--yes-code", code).ok()
                assert said.out.split()[-2:] == ["base", key_of(base)]
                assert other.communicate()[0].split()[-2:] == ["rover", key_of(rover)]
            assert (here.wait(), there.wait()) == (0, 0)
        until_peer(rover, "base")
        until_peer(base, "rover")
        rover.run("peers", "revoke", "base", "--why", "stolen").ok()
        rover.until_told("the host base is gone")
        base.until_told("the host rover is gone")
        (revoked,) = rover.ask("peers_trust")["revoked"]
        assert (revoked["fingerprint"], revoked["why"]) == (key_of(base), "stolen (base)")


def test_fleet_lets_its_hosts_in(tmp_path: Path) -> None:
    fleet = tmp_path / "survey"
    nondum("keys", "fleet", "new", fleet).ok()
    with looking(tmp_path, "rover", "base") as hosts:
        for host in hosts:
            public, certificate = host.work / "key.pub", host.work / "certificate"
            host.run("peers", "key", "-o", public).ok()
            nondum("keys", "fleet", "sign", public, "--fleet", fleet, "-o", certificate).ok()
            host.run("peers", "trust-fleet", fleet / "fleet.pub").ok()
            host.run("peers", "certify", certificate).ok()
        rover, base = hosts
        until_peer(rover, "base")
        until_peer(base, "rover")
