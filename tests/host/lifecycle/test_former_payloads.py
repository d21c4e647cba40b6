"""What is remembered of payloads that are gone, and for how long."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.host.lifecycle.states import AT, active, after, at_step, found, way_to_active

from nondum.host.core.events.catalogue import Recomposed
from nondum.host.core.events.drives import DriveInserted, DriveRemoved, DrivesScanned
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    ForgetAsked,
    PayloadCleared,
    PayloadFailed,
    PayloadWithdrawn,
)
from nondum.host.core.records.payload import FormerPayload, PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import former_payloads
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.former_payloads import remembering
from nondum.host.lifecycle.recovery import recover
from nondum.sdk.errors import Problem

ROOT = Path("/drives/a")
PAYLOAD: PayloadRecord = active().payloads["k1"]
PULLED: tuple[Event, ...] = (DriveRemoved("a"), PayloadCleared("k1"))


def described(state: HostState) -> dict[str, tuple[str, list[str]]]:
    return {id: (known.version, list(known.components)) for id, known in state.former.items()}


def left(payload_id: str, wall_s: float, size: int = 2) -> FormerPayload:
    return FormerPayload(payload_id, "1.0", {}, wall_s, size)


def test_pulled_payload_is_remembered_with_what_it_could_do() -> None:
    before = active()
    assert not before.former
    [known] = after(*PULLED, state=before)[0].former.values()
    assert (known.payload_id, known.version, known.left_wall_s) == ("org.x", "1.0", AT.wall_s)
    assert known.components == {"eye": before.components["eye"].description}


@pytest.mark.parametrize(
    "step", [s for s in Step if s not in (Step.ACTIVE, Step.REMOVING, Step.GONE)]
)
def test_payload_that_never_was_active_is_not_remembered(step: Step) -> None:
    assert not after(PayloadWithdrawn("k1", "pulled"), state=at_step(step))[0].former


def test_payload_pulled_while_no_daemon_ran_is_remembered() -> None:
    state = recover(active(), AT).state
    state, _ = after(DrivesScanned("slot", ()), PayloadCleared("k1"), state=state)
    assert not state.payloads
    assert described(state) == {"org.x": ("1.0", ["eye"])}


def test_payload_that_is_back_is_no_memory() -> None:
    state, _ = after(*PULLED, DriveInserted("a", ROOT, "slot"), state=active())
    assert state.former
    assert not after(*way_to_active(), state=state)[0].former


def test_newer_version_supersedes_what_is_remembered() -> None:
    state, _ = after(*PULLED, DriveInserted("a", ROOT, "slot"), state=active("eye"))
    newer = [found("k2", release=2), *way_to_active("k2", id="audio")[1:]]
    state, _ = after(*newer, state=state)
    assert not state.former, "nothing of the older version is offered beside the newer"
    state, _ = after(DriveRemoved("a"), state=state)
    assert described(state) == {"org.x": ("1.0", ["audio"])}


def test_memory_outlives_restarts_of_the_daemon() -> None:
    state, _ = after(*PULLED, state=active())
    assert recover(state, AT).state.former == state.former


def test_payload_that_fails_after_a_restart_is_still_remembered() -> None:
    state = recover(active(), AT).state
    state, _ = after(PayloadFailed("k1", (Problem("TEST", "made up"),)), state=state)
    assert described(state) == {"org.x": ("1.0", ["eye"])}


def test_person_has_a_payload_forgotten() -> None:
    state, _ = after(*PULLED, state=active())
    outcome = advance(state, ForgetAsked("org.x"), AT)
    assert not outcome.state.former
    assert outcome.events == (
        ForgetAsked("org.x"),
        Recomposed(state.revision + 1, "ForgetAsked"),
    )
    assert advance(outcome.state, ForgetAsked("org.x"), AT).events == ()


def test_those_that_left_first_are_forgotten_first() -> None:
    known = {f"org.{n}": left(f"org.{n}", float(n)) for n in range(former_payloads.PAYLOADS_LIMIT)}
    kept = remembering(known, PAYLOAD, [], 1000.0)
    assert len(kept) == former_payloads.PAYLOADS_LIMIT
    assert known.keys() - kept.keys() == {"org.0"}
    assert "org.x" in kept


def test_payload_that_said_too_much_displaces_no_other_one() -> None:
    known = {
        "org.long": left("org.long", 1.0, former_payloads.SIZE_LIMIT + 1),
        "org.short": left("org.short", 0.0),
    }
    assert remembering(known, PAYLOAD, [], 2.0).keys() == {"org.short", "org.x"}


@given(
    st.lists(st.tuples(st.floats(0, 999), st.integers(0, former_payloads.SIZE_LIMIT)), max_size=20)
)
def test_all_that_is_remembered_is_within_the_limits(payloads: list[tuple[float, int]]) -> None:
    known = {
        f"org.{n}": left(f"org.{n}", wall_s, size) for n, (wall_s, size) in enumerate(payloads)
    }
    kept = remembering(known, PAYLOAD, [], 1000.0)
    assert sum(payload.size for payload in kept.values()) <= former_payloads.SIZE_LIMIT
    assert "org.x" in kept, "the last that left comes first"
