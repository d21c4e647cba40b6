"""Strangers on the network, with all they have: nobody gets in, and the others' calls go on."""

from __future__ import annotations

import statistics
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.lab.faults.crew import Crew, crew, note, until
from tests.lab.faults.remote import PORT, Member

pytestmark = pytest.mark.lab

GROWTH_KB = 40_000
DESCRIPTORS = 400
"""256 connections that are no peers yet, and what a host has anyway."""


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
    with measured(rover, mule), attack(hosts, kind, mule):
        base.kill()
        mule.loses(base)
        base.start()  # whoever belongs there gets in meanwhile
        mule.meets(base)
        until(lambda: refused(mule, reasons) >= times)
        assert mule.descriptors() < DESCRIPTORS


def test_lies_about_who_is_where_lead_nobody_astray(hosts: Crew) -> None:
    rover, mule, base = hosts
    with measured(rover, mule), attack(hosts, "spoofed", mule):
        base.kill()
        mule.loses(base)
        base.start()
        hosts.all_meet()


@contextmanager
def attack(hosts: Crew, kind: str, victim: Member) -> Iterator[None]:
    """A stranger at work, on a machine of the same network."""
    machine = hosts.network.machine("stranger")
    hosts.network.plug(machine, hosts.switch)
    words = kind, victim.cable.address, str(PORT), victim.keys.public
    stranger = machine.python("tests.lab.faults.attacks", *words, stdout=subprocess.PIPE)
    assert stranger.stdout is not None
    assert stranger.stdout.readline() == b"begun\n"
    yield
    assert stranger.poll() is None, "it has given up"
    stranger.kill()


@contextmanager
def measured(caller: Member, victim: Member) -> Iterator[None]:
    """Have a host call another one meanwhile: all calls are answered, nobody else is let in, and
    the memory is bounded."""
    before_kb = victim.weight_kb()
    caller.ask("time", peer=victim.name, every_s=0.01)
    yield
    times = caller.ask("times")["times"]
    middle_ms, p99_ms = (statistics.quantiles(times, n=100)[n - 1] * 1000 for n in (50, 99))
    after_kb, descriptors = victim.weight_kb(), victim.descriptors()
    status = victim.ask("status")
    note(f"{len(times)} calls: median {middle_ms:.1f} ms, p99 {p99_ms:.1f} ms")
    note(f"{status['refused']}; {before_kb} kB, then {after_kb} kB; {descriptors} descriptors")
    assert after_kb < before_kb + GROWTH_KB
    assert status["peers"] == ["base", caller.name]
    assert status["lost"] == {"DISCONNECTED": 1}, "of the host that was killed"


def refused(victim: Member, reasons: set[str]) -> int:
    counts = victim.ask("status")["refused"]
    return sum(count for reason, count in counts.items() if reason in reasons)
