"""Two hosts that never met are introduced by their people, and parted again: whole daemons."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.daemon.neighbours import looking, until_peer
from tests.host.cli.daemon import command, nondum
from tests.kit.running_host import RunningHost

from nondum.transport.peers import fingerprint
from nondum.transport.peers.keys import load_or_create

pytestmark = pytest.mark.daemon


@contextmanager
def window(host: RunningHost) -> Iterator[subprocess.Popen[str]]:
    """A person's command that pairs a host."""
    arguments = command("--control", host.control, "peers", "pair", "--json")
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


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
        with window(rover) as here, window(base) as there:
            code = code_in(here)
            assert code_in(there) == code
            arguments = command("--control", base.control, "peers", "pair", "--yes-code", code)
            with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as other:
                said = nondum("--control", rover.control, "peers", "pair", "--yes-code", code).ok()
                assert said.out == f"paired with base  {key_of(base)}\n"
                assert other.communicate()[0] == f"paired with rover  {key_of(rover)}\n"
            assert (here.wait(), there.wait()) == (0, 0)
        until_peer(rover, "base")
        until_peer(base, "rover")
        nondum("--control", rover.control, "peers", "revoke", "base", "--why", "stolen").ok()
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
            nondum("--control", host.control, "peers", "key", "-o", public).ok()
            nondum("keys", "fleet", "sign", public, "--fleet", fleet, "-o", certificate).ok()
            peers = ("--control", host.control, "peers")
            nondum(*peers, "trust-fleet", fleet / "fleet.pub").ok()
            nondum(*peers, "certify", certificate).ok()
        rover, base = hosts
        until_peer(rover, "base")
        until_peer(base, "rover")
