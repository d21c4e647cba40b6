"""Networks that fall apart, lose in one direction, and come together again."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator

import pytest
from tests.daemon.peer_faults.crew import Crew, crew, note
from tests.daemon.peer_faults.remote import Member

pytestmark = pytest.mark.daemon

NAMES = ("rover", "mule", "scout", "base")
ROUNDS = pytest.mark.parametrize("rounds", [2, pytest.param(4, marks=pytest.mark.long("peers"))])
"""How often the network is parted and joined."""


@pytest.fixture(scope="module")
def fleet(seed: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Crew]:
    with crew(tmp_path_factory.mktemp("fleet"), *NAMES, seed=seed) as fleet:
        yield fleet


@pytest.fixture
def hosts(fleet: Crew) -> Iterator[Crew]:
    """Hosts that see each other, with nothing published."""
    yield fleet
    fleet.clear()


@pytest.mark.parametrize(
    "lose",
    [lambda member: member.cable.lose_sent(), lambda member: member.cable.lose_received()],
    ids=["what it sends", "what it is sent"],
)
def test_link_that_loses_in_one_direction_is_noticed_at_both_ends(
    lose: Callable[[Member], None], hosts: Crew
) -> None:
    rover, mule, scout, base = hosts
    mule.ask("publish", changes={"fact/parted": {"is": "no"}})
    hosts.all_see({"rover": {}, "mule": {"fact/parted": {"is": "no"}}, "scout": {}, "base": {}})
    began_s = time.monotonic()
    lose(mule)
    hosts.all_see({"rover": {}, "scout": {}, "base": {}}, by=[rover, scout, base])
    hosts.all_see({}, by=[mule])
    note(f"noticed by all after {time.monotonic() - began_s:.2f} s")
    assert rover.call(base, "echo")["answer"] == {}
    mule.ask("publish", changes={"fact/parted": None, "fact/alone": {"is": "yes"}})
    began_s = time.monotonic()
    mule.cable.heal()
    hosts.all_see({"rover": {}, "mule": {"fact/alone": {"is": "yes"}}, "scout": {}, "base": {}})
    note(f"healed after {time.monotonic() - began_s:.2f} s")


@ROUNDS
def test_halves_of_a_parted_network_go_on_and_know_everything_when_it_is_whole(
    rounds: int, hosts: Crew
) -> None:
    chance = random.Random(hosts.seed)
    catalogues: dict[str, dict[str, dict[str, int]]] = {name: {} for name in NAMES}
    for number in range(rounds):
        members = chance.sample(hosts.members, len(NAMES))
        halves = members[:2], members[2:]
        hosts.switch.split([member.cable for member in halves[0]])
        for half in halves:
            hosts.all_see({one.name: catalogues[one.name] for one in half}, by=half)
        for member in members:
            gone = chance.choice([[], sorted(catalogues[member.name])])
            changes = {key: None for key in gone} | {f"fact/{number}": {"round": number}}
            member.ask("publish", changes=changes)
            catalogues[member.name] |= {f"fact/{number}": {"round": number}}
            for key in gone:
                del catalogues[member.name][key]
        for half in halves:
            hosts.all_see({one.name: catalogues[one.name] for one in half}, by=half)
            assert half[0].call(half[1], "echo", round=number)["answer"] == {"round": number}
        began_s = time.monotonic()
        hosts.switch.join()
        hosts.all_see(catalogues)
        note(f"round {number}: alike after {time.monotonic() - began_s:.2f} s")


@ROUNDS
def test_work_goes_on_while_a_network_is_parted_and_joined(rounds: int, hosts: Crew) -> None:
    chance = random.Random(hosts.seed)
    hosts.live(change_s=0.03, ask_s=0.05)
    for _ in range(rounds):
        half = chance.sample(hosts.members, 2)
        hosts.switch.split([member.cable for member in half])
        hosts.all_meet(half, [member for member in hosts if member not in half])
        hosts.switch.join()
        hosts.all_meet()
    hosts.rest()
