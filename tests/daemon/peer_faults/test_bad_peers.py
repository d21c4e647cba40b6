"""A host that was let in and goes bad: it is its own loss, and nobody else's."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.daemon.peer_faults.crew import Crew, Trusting, crew, until
from tests.daemon.peer_faults.figures import measured
from tests.daemon.peer_faults.remote import PORT, Member

from nondum.transport.peers import HostKeys

pytestmark = pytest.mark.daemon

BAD = HostKeys.generate()
GROWTH_KB = 100_000
"""What may wait for a peer that does not listen, or of one that says too much: 64 MB, and some."""
CHANGES = 40
"""Of each of two good hosts, while the bad one is at work."""


@pytest.fixture
def hosts(seed: int, tmp_path: Path) -> Iterator[Crew]:
    trust = Trusting(("rover", "mule", "base"))
    trust.paired[BAD.public] = "bad"
    with crew(tmp_path, seed=seed, trust=trust) as hosts:
        yield hosts


@pytest.mark.parametrize("kind", ["calls", "long_notices", "reads", "greetings"])
def test_flood_is_cut(kind: str, hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, kind, mule):
        until(lambda: mule.ask("status")["refused"].get("FLOODING", 0) >= 5)
        mule.ask("miss", peer="bad")
        others_go_on(hosts)
    assert figures.growth_kb < GROWTH_KB


def test_catalogue_of_no_host_is_cut(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, "oversized", mule):
        until(lambda: mule.ask("status")["refused"].get("GARBAGE", 0) >= 3)
        others_go_on(hosts)
    assert figures.growth_kb < GROWTH_KB


@pytest.mark.parametrize("kind", ["endless_calls", "changes", "mute", "deaf"])
def test_bad_manners_are_bounded(kind: str, hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, kind, mule):
        others_go_on(hosts)
        status = mule.ask("status")
        assert status["running"] <= 256
    assert figures.growth_kb < GROWTH_KB
    if kind == "endless_calls":
        mule.ask("miss", peer="bad")
        mule.ask("idle")  # all that it had begun is halted


def test_late_answers_are_no_answers(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule), bad_peer(hosts, "late", mule):
        for _ in range(3):
            call = {"peer": "bad", "method": "echo", "args": {}, "deadline_s": 0.5}
            assert mule.ask("call", **call)["failure"] == "DEADLINE"
        assert "bad" in mule.ask("status")["peers"]
        others_go_on(hosts)


def others_go_on(hosts: Crew) -> None:
    """Good hosts' catalogues are known, and one that was killed comes back."""
    rover, mule, base = hosts
    for number in range(CHANGES):
        for member in (rover, base):
            member.ask("publish", changes={"fact/number": {"is": number}})
    for member in (rover, base):
        mule.ask("know", peer=member.name, entries={"fact/number": {"is": CHANGES - 1}})
    base.kill()
    mule.ask("miss", peer=base.name)
    base.start()
    base.ask("publish", changes={"fact/life": {"is": "new"}})
    mule.ask("know", peer=base.name, entries={"fact/life": {"is": "new"}})


@contextmanager
def bad_peer(hosts: Crew, kind: str, victim: Member) -> Iterator[None]:
    """A bad host at work, on a machine of the same network."""
    machine = hosts.network.machine("bad")
    hosts.network.plug(machine, hosts.switch)
    words = kind, victim.cable.address, str(PORT), victim.keys.public, BAD.public, BAD.secret
    process = machine.python("tests.daemon.peer_faults.bad_peers", *words, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"in\n"
    yield
    assert process.poll() is None, "it has given up"
    process.kill()
