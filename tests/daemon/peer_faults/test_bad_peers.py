"""A host that was let in and goes bad: it is its own loss, and nobody else's."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from tests.daemon.peer_faults.crew import Crew, Trusting, crew
from tests.daemon.peer_faults.figures import measured
from tests.daemon.peer_faults.remote import PORT, Member
from tests.kit.on_machine import started
from tests.kit.until import until

from nondum.transport.peers import HostKeys

pytestmark = pytest.mark.daemon

KINDS = (
    *("calls", "long_notices", "reads", "greetings", "oversized"),
    *("endless_calls", "changes", "mute", "deaf", "late"),
)
KEYS = {kind: HostKeys.generate() for kind in KINDS}
"""Of the bad host of each kind: what one has done is not held against the next."""
GROWTH_KB = 100_000
"""What may wait for a peer that does not listen, or of one that says too much: 64 MB, and some."""
CHANGES = 40
"""Of each of two good hosts, while the bad one is at work."""


@pytest.fixture(scope="module")
def fleet(seed: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Crew]:
    trust = Trusting(("rover", "mule", "base"))
    trust.paired |= {keys.public: "bad" for keys in KEYS.values()}
    with crew(tmp_path_factory.mktemp("fleet"), seed=seed, trust=trust) as fleet:
        yield fleet


@pytest.fixture
def hosts(fleet: Crew) -> Iterator[Crew]:
    """Good hosts that see each other, with nothing published."""
    yield fleet
    fleet.clear()


@pytest.mark.parametrize("kind", ["calls", "long_notices", "reads", "greetings"])
def test_flood_is_cut(kind: str, hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, kind, mule):
        until_refused(mule, "FLOODING", 5)
        mule.ask("miss", peer="bad")
        others_go_on(hosts, kind)
    assert figures.growth_kb < GROWTH_KB


def test_catalogue_of_no_host_is_cut(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, "oversized", mule):
        until_refused(mule, "GARBAGE", 3)
        others_go_on(hosts, "oversized")
    assert figures.growth_kb < GROWTH_KB


@pytest.mark.parametrize("kind", ["endless_calls", "changes", "mute", "deaf"])
def test_bad_manners_are_bounded(kind: str, hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, kind, mule):
        others_go_on(hosts, kind)
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
        others_go_on(hosts, "late")


def until_refused(host: Member, reason: str, times: int) -> None:
    """Wait until a host has refused so many more connections for that reason."""

    def refusals() -> dict[str, int]:
        found: dict[str, int] = host.ask("status")["refused"]
        return found

    wanted = refusals().get(reason, 0) + times
    until(f"{reason}", lambda: refusals().get(reason, 0) >= wanted, evidence=refusals)


def others_go_on(hosts: Crew, meanwhile: str) -> None:
    """Good hosts' catalogues are known, and one that was killed comes back."""
    rover, mule, base = hosts
    for number in range(CHANGES):
        for member in (rover, base):
            member.ask("publish", changes={f"fact/{meanwhile}": {"is": number}})
    for member in (rover, base):
        mule.ask("know", peer=member.name, entries={f"fact/{meanwhile}": {"is": CHANGES - 1}})
    base.kill()
    mule.ask("miss", peer=base.name)
    base.start()
    base.ask("publish", changes={"fact/life": {"is": "new"}})
    mule.ask("know", peer=base.name, entries={"fact/life": {"is": "new"}})


@contextmanager
def bad_peer(hosts: Crew, kind: str, victim: Member) -> Iterator[None]:
    """A bad host at work, on a machine of the same network."""
    machine, keys = hosts.network.machine(f"bad-{kind}"), KEYS[kind]
    hosts.network.plug(machine, hosts.switch)
    words = kind, victim.cable.address, str(PORT), victim.keys.public, keys.public, keys.secret
    process = started(machine, "tests.daemon.peer_faults.bad_peers", *words, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"in\n"
    yield
    assert process.poll() is None, "it has given up"
    process.kill()
    victim.ask("miss", peer="bad")
