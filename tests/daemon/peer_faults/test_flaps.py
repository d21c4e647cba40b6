"""Hundreds of times a link goes and comes back, while hosts tell each other things and work."""

from __future__ import annotations

import random
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from tests.daemon.peer_faults.crew import Crew, crew, note
from tests.daemon.peer_faults.remote import Member

pytestmark = pytest.mark.daemon

NAMES = ("rover", "mule", "scout", "base")
GROWTH_KB = 4_000
"""Fragments of memory; after 210 flaps of each of four hosts, 5 kB a flap would be noticed."""
SPARE = 20
"""Descriptors that may be more: a link that was dialled has some more than one that was accepted.
One that is left behind at every tenth loss would be noticed."""


@pytest.mark.timeout(240)
@pytest.mark.parametrize(
    ("warm_up", "flaps"), [(20, 40), pytest.param(40, 210, marks=pytest.mark.long("peers"))]
)
def test_all_know_the_same_in_the_end_and_nothing_is_done_twice(
    warm_up: int, flaps: int, seed: int, tmp_path: Path
) -> None:
    """Memory and descriptors are looked at after each host's first flaps, and after the others."""
    with crew(tmp_path, *NAMES, seed=seed) as hosts:
        storm(hosts, warm_up)
        before = [(member.weight_kb(), member.descriptors()) for member in hosts]
        storm(hosts, flaps)
        for member, (weight_kb, descriptors) in zip(hosts, before, strict=True):
            member.closes(descriptors + SPARE)
            after = member.weight_kb(), member.descriptors()
            note(f"{member.name}: {weight_kb} kB, {descriptors} descriptors; then {after}")
            assert after[0] <= weight_kb + GROWTH_KB
            status = member.ask("status")
            note(f"{member.name}: lost {status['lost']}, refused {status['refused']}")
            assert status["lost"], "no flap was noticed"
            assert "FLOODING" not in status["refused"]


def storm(hosts: Crew, flaps: int) -> None:
    """Pull and put back every host's cable so often while all are at work, then let them rest."""
    began_s = time.monotonic()
    hosts.live(change_s=0.03, ask_s=0.05)
    with ThreadPoolExecutor(len(hosts.members)) as pool:
        list(pool.map(lambda member: flap(member, flaps, hosts.seed), hosts))
    note(f"{flaps} flaps each in {time.monotonic() - began_s:.0f} s")
    hosts.rest()


def flap(member: Member, times: int, seed: int) -> None:
    """Flaps come in bursts; one in thirty is long enough to be noticed by itself."""
    chance, pause = random.Random(f"{seed} {member.name} {times}"), threading.Event()
    for number in range(times):
        pause.wait(chance.uniform(0.2, 0.9) if number % 10 == 0 else chance.uniform(0.0, 0.06))
        member.cable.pull()
        lengths = (0.0, 0.05), (0.1, 0.4), (1.2, 2.0)
        pause.wait(chance.uniform(*chance.choices(lengths, weights=(85, 12, 3))[0]))
        member.cable.put_back()
