"""Strangers on the network, with all they have: nobody gets in, and the others' calls go on."""

from __future__ import annotations

import statistics
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.daemon.peer_faults.crew import Crew, crew, until
from tests.daemon.peer_faults.figures import measured
from tests.daemon.peer_faults.remote import PORT, Member

pytestmark = pytest.mark.daemon

GROWTH_KB = 40_000
DESCRIPTORS = 400
"""256 connections that are no peers yet, and what a host has anyway. At a moment there may be more:
ZeroMQ accepts before anybody can count."""
SAMPLES = 100
"""Over five seconds: longer than a connection may take to become a peer's."""


@pytest.fixture
def hosts(seed: int, tmp_path: Path) -> Iterator[Crew]:
    with crew(tmp_path, "rover", "mule", "base", seed=seed) as hosts:
        yield hosts


@pytest.mark.parametrize(
    ("kind", "reasons", "times"),
    [
        ("unknown_keys", {"UNKNOWN_KEY"}, 10_000),
        ("other_mechanisms", {"MISMATCH", "GARBAGE"}, 2_000),
        ("garbage", {"MISMATCH", "GARBAGE"}, 10_000),
        ("slow", {"SILENT", "CROWDED"}, 2_000),
        ("long_frames", {"MISMATCH", "GARBAGE"}, 10_000),
        ("endless", {"SILENT", "CROWDED", "GARBAGE", "MISMATCH"}, 2_000),
    ],
)
def test_nobody_gets_in(kind: str, reasons: set[str], times: int, hosts: Crew) -> None:
    rover, mule, base = hosts
    with measured(rover, mule) as figures, attack(hosts, kind, mule):
        base.kill()
        mule.loses(base)
        base.start()  # whoever belongs there gets in meanwhile
        mule.meets(base)
        held: list[int] = []

        def has_seen_enough() -> bool:
            held.append(mule.descriptors())
            return len(held) >= SAMPLES and refused(mule, reasons) >= times

        until(has_seen_enough)
        assert statistics.median(held) < DESCRIPTORS, held
    assert figures.growth_kb < GROWTH_KB
    assert_no_stranger_is_in(mule)


def test_lies_about_who_is_where_lead_nobody_astray(hosts: Crew) -> None:
    rover, mule, base = hosts
    with measured(rover, mule), attack(hosts, "spoofed", mule):
        base.kill()
        mule.loses(base)
        base.start()
        hosts.all_meet()
    assert_no_stranger_is_in(mule)


@contextmanager
def attack(hosts: Crew, kind: str, victim: Member) -> Iterator[None]:
    """A stranger at work, on a machine of the same network."""
    machine = hosts.network.machine("stranger")
    hosts.network.plug(machine, hosts.switch)
    words = kind, victim.cable.address, str(PORT), victim.keys.public
    stranger = machine.python("tests.daemon.peer_faults.attacks", *words, stdout=subprocess.PIPE)
    assert stranger.stdout is not None
    assert stranger.stdout.readline() == b"begun\n"
    yield
    assert stranger.poll() is None, "it has given up"
    stranger.kill()


def assert_no_stranger_is_in(victim: Member) -> None:
    assert victim.ask("status")["met"] == ["base", "rover"]


def refused(victim: Member, reasons: set[str]) -> int:
    counts = victim.ask("status")["refused"]
    return sum(count for reason, count in counts.items() if reason in reasons)
