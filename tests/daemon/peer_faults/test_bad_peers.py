"""A host that was let in and goes bad: it loses its peers, and the others go on."""

from __future__ import annotations

import statistics
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
    *("endless_parts", "drip", "half_open", "names", "deltas", "certificates"),
)
KEYS = {kind: HostKeys.generate() for kind in KINDS}
"""Of the bad host of each kind: what one has done is not held against the next."""
GROWTH_KB = 100_000
"""What may wait for a peer that does not listen, or of one that says too much: 64 MB, and some."""
PEAK_KB = 200_000
"""What may come of a message without end until it is cut, at the speed of one machine's memory."""
DESCRIPTORS = 400
"""256 connections that are no peers yet, and what a host has anyway."""
SAMPLES = 10
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
        good_hosts_go_on(hosts, kind)
    assert figures.growth_kb < GROWTH_KB


def test_catalogue_of_no_host_is_cut(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, "oversized", mule):
        until_refused(mule, "GARBAGE", 3)
        good_hosts_go_on(hosts, "oversized")
    assert figures.growth_kb < GROWTH_KB


@pytest.mark.parametrize("kind", ["endless_calls", "changes", "mute", "deaf"])
def test_bad_manners_are_bounded(kind: str, hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, kind, mule):
        good_hosts_go_on(hosts, kind)
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
        good_hosts_go_on(hosts, "late")


def test_message_without_end_is_cut_before_it_fills_the_memory(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, "endless_parts", mule):
        until_refused(mule, "ENDLESS", 1)
        mule.ask("miss", peer="bad")
        until_refused(mule, "FLOODING", 1)  # it has come back, and is not let in
        good_hosts_go_on(hosts, "endless_parts")
    assert figures.peak_kb < PEAK_KB


def test_byte_at_a_time_makes_no_other_host_wait(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, "drip", mule):
        until_lost(mule, "SILENT", 2)
        good_hosts_go_on(hosts, "drip")
    assert figures.growth_kb < GROWTH_KB


def test_connections_of_a_proved_key_that_never_greet_are_bounded(hosts: Crew) -> None:
    rover, mule, _ = hosts
    held: list[int] = []
    with measured(rover, mule) as figures, bad_peer(hosts, "half_open", mule):
        for _ in range(SAMPLES):
            until_refused(mule, "CROWDED", 50)
            held.append(mule.descriptors())
        good_hosts_go_on(hosts, "half_open")
    assert statistics.median(held) < DESCRIPTORS, held
    assert figures.growth_kb < GROWTH_KB


def test_proved_key_is_one_host_whatever_it_calls_itself(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, "names", mule):
        until_refused(mule, "NOT_PROVED", 20)
        until_refused(mule, "FLOODING", 5)
        good_hosts_go_on(hosts, "names")
        assert set(mule.ask("status")["met"]) == {"bad", "base", "rover"}
    assert figures.growth_kb < GROWTH_KB


def test_catalogue_that_grows_beyond_bounds_by_changes_is_cut(hosts: Crew) -> None:
    rover, mule, _ = hosts
    with measured(rover, mule) as figures, bad_peer(hosts, "deltas", mule):
        until_refused(mule, "GARBAGE", 3)
        good_hosts_go_on(hosts, "deltas")
    assert figures.growth_kb < GROWTH_KB


@pytest.fixture(scope="module")
def certified(seed: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Crew]:
    trust = Trusting(("rover", "mule", "base"), by_fleet=True)
    with crew(tmp_path_factory.mktemp("certified"), seed=seed, trust=trust) as fleet:
        yield fleet
        fleet.clear()


def test_invalid_certificates_let_no_host_in_nor_a_revoked_one_again(
    certified: Crew,
) -> None:
    rover, mule, _ = certified
    with measured(rover, mule) as figures, bad_peer(certified, "certificates", mule):
        until_refused(mule, "CERTIFICATE", 28)  # each twice; the good one lets it in in between
        mule.ask("revoke", key=KEYS["certificates"].public)
        mule.ask("miss", peer="bad")
        until_refused(mule, "REVOKED", 10)
        good_hosts_go_on(certified, "certificates")
        assert "bad" not in mule.ask("status")["peers"]
    assert figures.growth_kb < GROWTH_KB


def until_lost(host: Member, reason: str, times: int) -> None:
    """Wait until a host has lost peers `times` more times for that reason."""

    def lost() -> dict[str, int]:
        found: dict[str, int] = host.ask("status")["lost"]
        return found

    wanted = lost().get(reason, 0) + times
    until(f"{reason}", lambda: lost().get(reason, 0) >= wanted, evidence=lost)


def until_refused(host: Member, reason: str, times: int) -> None:
    """Wait until a host has refused `times` more connections for that reason."""

    def refusals() -> dict[str, int]:
        found: dict[str, int] = host.ask("status")["refused"]
        return found

    wanted = refusals().get(reason, 0) + times
    until(f"{reason}", lambda: refusals().get(reason, 0) >= wanted, evidence=refusals)


def good_hosts_go_on(hosts: Crew, meanwhile: str) -> None:
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
    words = [kind, victim.cable.address, str(PORT), victim.keys.public, keys.public, keys.secret]
    if hosts.fleet_secret:
        words.append(hosts.fleet_secret.hex())
    process = started(machine, "tests.daemon.peer_faults.bad_peers", *words, stdout=subprocess.PIPE)
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == b"in\n"
        yield
        assert process.poll() is None, "it has given up"
    finally:
        process.kill()
    victim.ask("miss", peer="bad")
