"""Attacks by hosts that are not trusted: none is let in, and the others' calls go on."""

from __future__ import annotations

import statistics
import subprocess
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from tests.daemon.peer_faults.crew import Crew, crew
from tests.daemon.peer_faults.figures import measured
from tests.daemon.peer_faults.remote import PORT, Member
from tests.kit.on_machine import started
from tests.kit.until import until

pytestmark = pytest.mark.daemon

GROWTH_KB = 40_000
DESCRIPTORS = 400
"""256 connections that are no peers yet, and what a host has anyway. At a moment there may be more:
ZeroMQ accepts before anybody can count."""
SAMPLES = 40
SPARE = 20
"""Descriptors that may be more once the stranger is gone: links that were dialled another way."""
REFUSED = {
    "unknown_keys": {"UNKNOWN_KEY"},
    "other_mechanisms": {"MISMATCH", "GARBAGE"},
    "garbage": {"MISMATCH", "GARBAGE"},
    "slow": {"SILENT", "CROWDED"},
    "long_frames": {"MISMATCH", "GARBAGE"},
    "endless": {"SILENT", "CROWDED", "GARBAGE", "MISMATCH"},
}
"""Kind of attack → what its connections are refused for."""
MANY = pytest.mark.parametrize(
    "many", [2_000, pytest.param(10_000, marks=pytest.mark.long("peers"))]
)


@pytest.fixture(scope="module")
def fleet(seed: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Crew]:
    with crew(tmp_path_factory.mktemp("fleet"), "rover", "mule", "base", seed=seed) as fleet:
        yield fleet


@pytest.fixture
def hosts(fleet: Crew) -> Iterator[Crew]:
    """Hosts that see each other, with nothing published."""
    yield fleet
    fleet.clear()


@pytest.mark.parametrize("kind", REFUSED)
@MANY
def test_no_stranger_gets_in(many: int, kind: str, hosts: Crew) -> None:
    rover, mule, base = hosts
    reasons = REFUSED[kind]
    with measured(rover, mule) as figures, attack(hosts, kind, mule):
        base.kill()
        mule.loses(base)
        base.start()  # a host that belongs there gets in meanwhile
        mule.meets(base)
        before = refusals(mule)
        held: list[int] = []

        def has_seen_enough() -> bool:
            held.append(mule.descriptors())
            counts = refusals(mule) - before
            return len(held) >= SAMPLES and sum(counts[reason] for reason in reasons) >= many

        until("enough strangers were refused", has_seen_enough, evidence=lambda: refusals(mule))
        assert statistics.median(held) < DESCRIPTORS, held
    assert figures.growth_kb < GROWTH_KB
    assert_no_stranger_is_in(mule)


def test_spoofed_announcements_do_not_keep_hosts_apart(hosts: Crew) -> None:
    rover, mule, base = hosts
    with measured(rover, mule), attack(hosts, "spoofed", mule):
        base.kill()
        mule.loses(base)
        base.start()
        hosts.all_meet()
    assert_no_stranger_is_in(mule)


@contextmanager
def attack(hosts: Crew, kind: str, victim: Member) -> Iterator[None]:
    """A stranger at work, on a machine of the same network. Once it is gone, so are all connections
    that it had opened."""
    machine = hosts.network.machine(f"stranger{len(hosts.network.machines)}")
    hosts.network.plug(machine, hosts.switch)
    before = victim.descriptors()
    words = kind, victim.cable.address, str(PORT), victim.keys.public
    stranger = started(machine, "tests.daemon.peer_faults.attacks", *words, stdout=subprocess.PIPE)
    assert stranger.stdout is not None
    assert stranger.stdout.readline() == b"begun\n"
    yield
    assert stranger.poll() is None, "it has given up"
    stranger.kill()
    victim.closes(before + SPARE)


def assert_no_stranger_is_in(victim: Member) -> None:
    assert victim.ask("status")["met"] == ["base", "rover"]


def refusals(victim: Member) -> Counter[str]:
    """Reason → how many connections it has refused for that."""
    return Counter(victim.ask("status")["refused"])
