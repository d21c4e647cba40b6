"""What was left alone since daemons died at it has one trial, an hour later."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.lifecycle.states import AT, active, after, drive, found, way_to_active
from tests.kit.clock import VirtualClock

from nondum.host.core import effects
from nondum.host.core.events.daemon import HostStable, HostStarted, SafeModeLeft, TrialDue
from nondum.host.core.events.drives import DriveRead, DriveRetried
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadCleared, RetryAsked
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import crash_attribution, safe_mode
from nondum.host.lifecycle.advance import advance
from nondum.host.lifecycle.crash_attribution import ATTEMPTS, STEADY_S
from nondum.host.lifecycle.recovery import recover
from nondum.host.manager.automatic_retry import AFTER_S, APART_S, hold
from nondum.host.manager.crash_loop import SOON_S, CrashCounter

DUE = TrialDue("spot")
LATER = Moment(AT.monotonic_s + STEADY_S, AT.wall_s)


def on(state: HostState, *happened: Event) -> HostState:
    return after(*happened, state=state)[0]


def died(state: HostState, times: int = 1) -> HostState:
    for _ in range(times):
        state = recover(state, AT).state
        if all(p.step is not Step.QUARANTINED for p in state.payloads.values()):
            state = on(state, drive(), DriveRead("a", ("k1",)), *way_to_active()[5:])
    return state


def left_alone() -> HostState:
    """A payload that five daemons died at."""
    state = died(active(), ATTEMPTS)
    assert state.payloads["k1"].step is Step.QUARANTINED
    return on(state, drive(), DriveRead("a", ("k1",)))


def test_payload_is_tried_once_and_is_well_if_the_daemon_lives() -> None:
    state, done = after(DUE, state=left_alone())
    assert state.payloads["k1"].step is Step.STORED
    assert [type(effect) for effect in done] == [effects.ProbeComponents]
    state = on(state, *way_to_active()[5:])
    assert not advance(state, HostStable("spot"), LATER).state.tries


def test_payload_that_kills_its_trial_is_left_to_people() -> None:
    before = left_alone()
    tried = on(before, DUE)
    state = on(died(tried), drive(), DriveRead("a", ("k1",)))
    assert state.payloads["k1"].step is Step.QUARANTINED
    (foretold,), (untried,) = before.payloads["k1"].problems, state.payloads["k1"].problems
    assert (foretold.code, untried.code) == ("QUARANTINED", "QUARANTINED")
    assert len(foretold.fix) > len(untried.fix), "it is foretold, then no more"
    assert on(state, DUE).payloads["k1"].step is Step.QUARANTINED
    asked = on(state, RetryAsked("k1"))
    assert asked.payloads["k1"].step is Step.STORED
    assert not asked.tries


def test_trials_come_one_after_the_other() -> None:
    """Or it would not be known which of them the daemon died of."""
    state = left_alone()
    other = replace(state.payloads["k1"], key="k2", payload_id="org.y", digest="other")
    state = replace(
        state, payloads={**state.payloads, "k2": other}, tries={**state.tries, "k2": ATTEMPTS}
    )
    state = on(state, DUE, DUE)
    steps = {key: payload.step for key, payload in state.payloads.items()}
    assert steps == {"k1": Step.STORED, "k2": Step.QUARANTINED}


def test_drive_has_a_trial_too() -> None:
    state = HostState("spot")
    for _ in range(ATTEMPTS):
        state = recover(on(state, drive()), AT).state
    state = on(state, drive())
    for why in (DUE, DriveRetried("a")):
        again, done = after(why, state=state)
        assert any(isinstance(effect, effects.ReadDrive) for effect in done)
        assert not on(again, DriveRead("a", ())).tries


def test_payload_of_a_drive_that_was_refused_comes_in_with_its_trial() -> None:
    state = on(HostState("spot", tries={"k1": ATTEMPTS}), drive(), found())
    assert state.payloads["k1"].step is Step.REFUSED
    state = on(state, DUE, PayloadCleared("k1"), found())
    assert state.payloads["k1"].step is Step.RECEIVED


def test_nothing_is_tried_in_safe_mode() -> None:
    state = replace(left_alone(), safety=Safety.INITIAL)
    assert on(state, DUE) == state


def test_people_are_told_how_many_deaths_are_left() -> None:
    state = died(active(), 3)
    (told,) = crash_attribution.counts(state.snapshot())
    assert "3 daemons" in told
    assert f"after {ATTEMPTS}" in told
    assert not list(crash_attribution.counts(left_alone().snapshot()))
    assert len(list(crash_attribution.counts(on(left_alone(), DUE).snapshot()))) == 1


class Daemon:
    """As far as trials go: what it is, and what it emits."""

    def __init__(self, state: Path, asked: Safety = Safety.OFF) -> None:
        self.counter = CrashCounter(state)
        self.safety, _ = self.counter.begin(asked)
        self.counter.on_event(HostStarted("spot"))
        self.emitted: list[type[Event]] = []
        self.emits = asyncio.Event()

    def emit(self, event: Event) -> None:
        self.emitted.append(type(event))
        self.emits.set()

    def start(self) -> list[asyncio.Task[None]]:
        def snapshot() -> Snapshot:
            return Snapshot("spot", 1, safety=self.safety)

        holding = hold(snapshot, self.counter, self.emit)
        return [asyncio.create_task(self.counter.outlive()), asyncio.create_task(holding)]


def deaths(state: Path, times: int) -> None:
    for _ in range(times):
        CrashCounter(state).begin()


@pytest.mark.anyio
async def test_trials_begin_after_an_hour(tmp_path: Path, clock: VirtualClock) -> None:
    daemon = Daemon(tmp_path)
    tasks = daemon.start()
    await clock.advance(AFTER_S - 1)
    assert daemon.emitted == []
    await clock.advance(1 + APART_S)
    assert daemon.emitted == [TrialDue, TrialDue]
    for task in tasks:
        task.cancel()


@pytest.mark.anyio
async def test_safe_mode_is_left_after_an_hour_and_the_next_death_leads_back(
    tmp_path: Path, clock: VirtualClock
) -> None:
    deaths(tmp_path, safe_mode.DEATHS)
    daemon = Daemon(tmp_path)
    assert daemon.safety is Safety.INITIAL
    begun_s, tasks = clock.time(), daemon.start()
    await clock.advance_until(tasks[0], step_s=SOON_S)
    await clock.advance(begun_s + AFTER_S - 1 - clock.time())
    await clock.advance_until(daemon.emits.wait(), step_s=1.0)
    assert daemon.emitted == [SafeModeLeft]
    for task in tasks:
        task.cancel()
    assert CrashCounter(tmp_path).begin()[0] is Safety.INITIAL


@pytest.mark.anyio
async def test_safe_mode_that_is_survived_is_over(tmp_path: Path, clock: VirtualClock) -> None:
    deaths(tmp_path, safe_mode.DEATHS)
    daemon = Daemon(tmp_path)
    tasks = daemon.start()
    while TrialDue not in daemon.emitted:
        daemon.emits.clear()
        await clock.advance_until(daemon.emits.wait(), step_s=SOON_S)
    for task in tasks:
        task.cancel()
    assert CrashCounter(tmp_path).begin()[0] is Safety.OFF


@pytest.mark.anyio
async def test_safe_mode_that_a_person_wants_stays(tmp_path: Path, clock: VirtualClock) -> None:
    deaths(tmp_path, safe_mode.DEATHS)
    daemon = Daemon(tmp_path, Safety.INITIAL)
    tasks = daemon.start()
    await clock.advance_until(daemon.emits.wait(), step_s=SOON_S)
    assert daemon.emitted == [TrialDue]
    for task in tasks:
        task.cancel()


def test_deaths_before_safe_mode_are_told(tmp_path: Path) -> None:
    deaths(tmp_path, 3)
    counter = CrashCounter(tmp_path)
    counter.begin()
    (told,) = counter.warnings()
    assert "3 daemons" in told
    assert f"after {safe_mode.DEATHS}" in told
    assert not CrashCounter(tmp_path / "new").warnings()
