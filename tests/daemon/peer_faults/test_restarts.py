"""Hosts that die and start again, hosts that are there twice, and hosts whose clocks are wrong."""

from __future__ import annotations

import random
import threading
from collections import Counter
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest
from tests.daemon.peer_faults.crew import Crew, Trusting, crew

from nondum.transport.peers import HostKeys

pytestmark = pytest.mark.daemon

LONG_S = 60.0
"""Work that is not done before the test is."""
NO_CLOCK_S = -timedelta(days=3650).total_seconds()
"""A machine without a battery begins with the day it was made on."""
TOO_LATE_S = timedelta(days=40).total_seconds()
LAMP = {"component/lamp": {"units": ["lamp"]}}


@pytest.fixture(scope="module")
def fleet(seed: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Crew]:
    with crew(tmp_path_factory.mktemp("fleet"), "rover", "mule", "base", seed=seed) as fleet:
        yield fleet


@pytest.fixture
def hosts(fleet: Crew) -> Iterator[Crew]:
    """Hosts that see each other, with nothing published."""
    yield fleet
    fleet.clear()


def test_killed_host_comes_back_with_what_it_tells_now(hosts: Crew) -> None:
    rover, mule, base = hosts
    mule.ask("publish", changes=LAMP)
    hosts.all_see({"rover": {}, "mule": LAMP, "base": {}})
    before = mule.epoch
    mule.kill()
    for other in (rover, base):
        assert other.loses(mule)["reason"] == "DISCONNECTED"
    assert mule.start() != before
    for other in (rover, base):
        assert other.meets(mule)["epoch"] == mule.epoch
    hosts.all_see({"rover": {}, "mule": {}, "base": {}})


def test_host_that_restarts_before_its_death_is_noticed_does_nothing_twice(hosts: Crew) -> None:
    rover, mule, _ = hosts
    mule.ask("publish", changes=LAMP)
    hosts.all_see({"rover": {}, "mule": LAMP, "base": {}})
    call = rover.order("call", **work(mule.name, "work.finish"))
    rover.call(mule, "echo")  # what came before it has begun
    rover.forget()
    mule.cable.pull()  # so that no peer sees its connections end
    mule.kill()
    mule.cable.put_back()
    mule.start()
    rover.loses(mule)
    assert rover.meets(mule)["epoch"] == mule.epoch
    assert call.get(timeout=60)["failure"] == "PEER_LOST"
    hosts.all_see({"rover": {}, "mule": {}, "base": {}})
    assert mule.ask("status")["running"] == 0
    hosts.check_work()


@pytest.mark.parametrize("restarts", [5, pytest.param(12, marks=pytest.mark.long("peers"))])
def test_hosts_that_die_again_and_again_while_all_are_at_work(restarts: int, hosts: Crew) -> None:
    chance, pause = random.Random(hosts.seed), threading.Event()
    hosts.live(change_s=0.03, ask_s=0.05)
    for _ in range(restarts):
        member = chance.choice(hosts.members)
        chance.choice([member.kill, member.kill, member.leave])()
        pause.wait(chance.choice([0.0, 0.0, 0.3, 1.5]))
        member.start()
        member.ask("live", change_s=0.03, ask_s=0.05)
        pause.wait(chance.uniform(0.0, 0.5))
    hosts.rest()


def test_second_host_of_one_name_waits_until_the_first_is_gone(seed: int, tmp_path: Path) -> None:
    trust = Trusting(("rover", "mule"))
    other_keys = HostKeys.generate()
    trust.paired[other_keys.public] = "mule"
    with crew(tmp_path, seed=seed, trust=trust) as hosts:
        rover, mule = hosts
        second = hosts.add("other-mule", other_keys, name="mule")
        second.start()
        second.next("failed", code="PEER_NAME_TAKEN", key=rover.keys.public)
        assert rover.call(mule, "echo", word="hello")["answer"] == {"word": "hello"}
        assert rover.ask("status")["refused"]["DUPLICATE"]
        mule.leave()
        rover.loses(mule)
        assert rover.meets(mule)["key"] == other_keys.public


def test_copy_of_a_host_takes_its_place_and_the_first_is_told(hosts: Crew) -> None:
    rover, mule, base = hosts
    lost: Counter[str] = Counter(rover.ask("status")["lost"])
    copy = hosts.add("copy", mule.keys, name="mule")
    copy.start()
    for other in (rover, base):
        assert other.loses(mule)["reason"] == "RESTARTED"
        assert other.meets(mule)["epoch"] == copy.epoch
    assert mule.next("failed")["code"] == "PEER_DUPLICATE"
    copy.ask("publish", changes=LAMP)
    hosts.all_see({"rover": {}, "mule": LAMP, "base": {}}, by=[rover, base])
    assert Counter(rover.ask("status")["lost"]) == lost + Counter(RESTARTED=1)
    copy.leave()
    mule.kill()
    mule.start()
    hosts.all_see({"rover": {}, "mule": {}, "base": {}})


@pytest.fixture(scope="module")
def certified_fleet(seed: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Crew]:
    trust = Trusting(("rover", "mule", "base"), by_fleet=True)
    with crew(tmp_path_factory.mktemp("certified"), seed=seed, trust=trust) as fleet:
        yield fleet


@pytest.fixture
def certified(certified_fleet: Crew) -> Iterator[Crew]:
    """Hosts that trust each other by certificates of their fleet, which end some day."""
    yield certified_fleet
    certified_fleet.clear()


@pytest.mark.parametrize("skew_s", [NO_CLOCK_S, TOO_LATE_S], ids=["past", "future"])
def test_host_without_the_time_of_day_meets_its_fleet_once_it_has_it(
    skew_s: float, certified: Crew
) -> None:
    rover, mule, base = certified
    mule.ask("set_clock", skew_s=skew_s)
    mule.kill()
    mule.start(skew_s=skew_s)
    for other in (rover, base):
        other.loses(mule)
        other.next("failed", code="CERTIFICATE_TIME")
    mule.ask("set_clock", skew_s=0)
    certified.all_see({"rover": {}, "mule": {}, "base": {}})


def test_certificates_that_end_part_a_fleet_until_the_clock_is_right(certified: Crew) -> None:
    rover, mule, base = certified
    mule.ask("set_clock", skew_s=TOO_LATE_S)
    for other in (rover, base):
        assert other.loses(mule)["reason"] == "TURNED_AWAY"
    assert rover.call(base, "echo")["answer"] == {}
    mule.ask("set_clock", skew_s=0)
    certified.all_see({"rover": {}, "mule": {}, "base": {}})


@pytest.mark.parametrize("skew_s", [NO_CLOCK_S, TOO_LATE_S], ids=["past", "future"])
def test_paired_hosts_need_no_clock(skew_s: float, hosts: Crew) -> None:
    rover, mule, base = hosts
    mule.ask("set_clock", skew_s=skew_s)
    for other in (rover, base):
        other.forget()
    mule.kill()
    mule.start(skew_s=skew_s)
    for other in (rover, base):
        assert other.meets(mule)["epoch"] == mule.epoch
    hosts.all_see({"rover": {}, "mule": {}, "base": {}})
    call = {"peer": "mule", "method": "work.stop"}
    args: dict[str, object] = {"piece": "one", "for_s": 0.1}
    answer = rover.ask("call", args=args, deadline_s=LONG_S, **call)
    assert answer.get("answer") == {"piece": "one"}, answer
    answer = rover.ask("call", args={"piece": "two", "for_s": LONG_S}, deadline_s=1, **call)
    assert answer.get("failure") == "DEADLINE", answer


def work(peer: str, method: str) -> dict[str, object]:
    """Arguments of a call that lasts."""
    args = {"piece": "long", "for_s": LONG_S}
    return {"peer": peer, "method": method, "args": args, "deadline_s": 2 * LONG_S}
