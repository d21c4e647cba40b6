"""Hosts that do not know each other stay apart, until people introduce them."""

from __future__ import annotations

import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from demo.robot import NONDUM
from tests.daemon.neighbours import looking, open_host, until_peer
from tests.kit.running_host import RunningHost
from tests.kit.until import until

from nondum.host.control.client import ControlClient

pytestmark = pytest.mark.daemon


@contextmanager
def strangers(work: Path) -> Iterator[tuple[RunningHost, RunningHost]]:
    """Two hosts with keys that look for each other, and were never introduced."""
    with looking(work, "rover", "mule") as (rover, mule):
        for host in (rover, mule):
            until_peers(host, lambda view: view["hosts"])
        yield rover, mule


def cli(host: RunningHost, *arguments: str | Path) -> str:
    """What `nondum …` prints about a host. Raises `CalledProcessError`."""
    command = [*NONDUM, "--control", str(host.control), *map(str, arguments)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return done.stdout


def is_peer(host: RunningHost, other: str) -> bool:
    return any(row["peer"] == other and row["state"] == "here" for row in host.ask("peers"))


def until_peers(host: RunningHost, found: Callable[[dict[str, Any]], Any]) -> None:
    """Wait until what a host says of who is here and who is not satisfies `found`."""

    def said() -> dict[str, Any]:
        answer: dict[str, Any] = host.ask("peers_why")
        return answer

    until(f"peers of {host.name}", lambda: found(said()), evidence=said)


def paired(first: RunningHost, second: RunningHost) -> None:
    """Pair two hosts as two people do who compare codes."""
    codes: dict[str, str] = {}
    both_seen = threading.Barrier(2, timeout=60)

    def pair(host: RunningHost, other: RunningHost) -> str:
        with ControlClient(host.control, timeout_s=60) as client:
            steps = client.follow("peers_pair")
            seen = next(row for row in steps if row["step"] == "comparing")
            assert seen["name"] == other.name
            codes[host.name] = seen["code"]
            both_seen.wait()
            host.ask("peers_confirm", code=codes[other.name])
            ends = (row["step"] for row in steps if row["step"] in ("agreed", "failed"))
            return str(next(ends))

    with ThreadPoolExecutor(2) as people:
        ends = people.map(pair, (first, second), (second, first))
        assert list(ends) == ["agreed", "agreed"]


def test_hosts_that_were_never_introduced_stay_apart(tmp_path: Path) -> None:
    with strangers(tmp_path) as (rover, mule):
        for host, other in ((rover, "mule"), (mule, "rover")):
            (found,) = host.ask("peers_why")["hosts"]
            assert (found["peer"], found["state"], found["standing"]) == (other, "away", "unknown")
            assert not is_peer(host, other)


def test_host_listens_at_another_port_when_its_own_is_taken_and_says_so(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with open_host(tmp_path / "rover", "rover", port) as (rover, _):
            rover.until_told("this host listens elsewhere")
            (warning,) = [w for w in rover.ask("status")["warnings"] if "ADDRESS_UNUSABLE" in w]
            assert str(port) in warning


def test_paired_hosts_are_peers_until_one_is_revoked(tmp_path: Path) -> None:
    with strangers(tmp_path) as (rover, mule):
        paired(rover, mule)
        until_peer(rover, "mule")
        until_peer(mule, "rover")
        (row,) = rover.ask("peers")
        assert (row["peer"], row["state"], row["by"]) == ("mule", "here", "pairing")
        cli(rover, "peers", "revoke", "mule", "--why", "it was stolen")
        rover.until_told("the host mule is gone")
        mule.until_told("the host rover is gone")
        mule.stop()
        mule.start()
        until_peers(rover, lambda view: view["refused"])
        assert not is_peer(rover, "mule")


def test_fleet_lets_hosts_in_with_certificates_from_a_drive(tmp_path: Path) -> None:
    fleet, drive = tmp_path / "fleet", tmp_path / "drive"
    subprocess.run([*NONDUM, "keys", "fleet", "new", fleet], check=True, capture_output=True)
    with strangers(tmp_path) as (rover, mule):
        (drive / "nondum-peers").mkdir(parents=True)
        for host in (rover, mule):
            out = drive / "nondum-peers" / f"{host.name}.certificate"
            public = host.ask("peers_key")["public"]
            named = tmp_path / f"{host.name}.pub"
            named.write_text(public, encoding="utf-8")
            sign = ["keys", "fleet", "sign", named, "--fleet", fleet, "--out", out]
            subprocess.run([*NONDUM, *map(str, sign)], check=True, capture_output=True)
        for host in (rover, mule):
            cli(host, "peers", "trust-fleet", fleet / "fleet.pub")
            host.plug(drive)
            host.until_told("has brought this host's certificate")
        until_peer(rover, "mule")
        until_peer(mule, "rover")
        assert {row["by"] for row in rover.ask("peers")} == {"certificate"}
