"""The daemon is killed at every commit of every transition, and comes back consistent by itself.

Before and after each row of both tables, each alone, up to twenty times: `python -m tests.faults`.
"""

from __future__ import annotations

import asyncio
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.faults.chains import CHAINS
from tests.faults.model import Told, check, look, recover_twice
from tests.kit.fork_server import Nursery

from nondum.host.core.events.payloads import PayloadWithdrawn
from nondum.host.core.events.placement import PayloadSentAway
from nondum.host.core.events.trust import PayloadDistrusted
from nondum.host.core.records.step import Step
from nondum.host.core.transitions import COMPONENT_TRANSITIONS, TRANSITIONS

KILLED = -9
ENDINGS = (PayloadSentAway, PayloadDistrusted, PayloadWithdrawn)
"""What may come at any step: one mechanism, so one of them is enough for each step."""
BROUGHT_TO_LIFE = (Step.STORED, Step.PROBED, Step.ACTIVE)

ROWS = {kill.row for chain in CHAINS.values() for kill in chain.kills}


def rows_of(when: str) -> Iterator[tuple[str, str]]:
    """The rows at which a daemon is to be killed before, or after, the commit. Before it where a
    payload is brought to life: of one that is copied, a kill before leaves what one after the row
    before leaves, and a file or two."""
    for (step, event), row in TRANSITIONS.items():
        is_before = row.effect is not None and row.to in BROUGHT_TO_LIFE
        if event not in ENDINGS and (when == "AFTER" or is_before):
            yield step.name, event.__name__
    if when == "AFTER":
        for state, event in COMPONENT_TRANSITIONS:
            yield state.name, event.__name__


@pytest.mark.parametrize("when", ["BEFORE", "AFTER"])
def test_every_row_is_in_a_chain(when: str) -> None:
    assert {(when, *row) for row in rows_of(when)} <= ROWS


def test_every_step_is_ended_and_every_ending_comes() -> None:
    ended = [(s, e) for when, s, e in ROWS if e in {ending.__name__ for ending in ENDINGS}]
    assert {step for step, _ in ended} == {s.name for s, e in TRANSITIONS if e in ENDINGS}
    assert {event for _, event in ended} == {ending.__name__ for ending in ENDINGS}


def copied(root: Path, folder: Path) -> Path:
    """A copy of the state folder: the next daemon is to find what the last one left."""
    folder.mkdir()
    subprocess.run(["cp", "-a", root / "state", folder], check=True)
    return folder


@pytest.mark.parametrize("name", CHAINS)
def test_kill_at_transitions(nursery: Nursery, tmp_path: Path, name: str) -> None:
    chain = CHAINS[name]
    chain.prepare(tmp_path)
    for kill in chain.kills:
        nursery.run(kill.orders(tmp_path), expect=KILLED)
        assert not list(look(tmp_path, Told.of(tmp_path))), kill
        copy = copied(tmp_path, tmp_path / f"after {kill.at}")
        assert not asyncio.run(recover_twice(copy)), kill
    ended = check(tmp_path)
    assert not ended.wrong
    assert not chain.end.out_of_place(ended.steps)
