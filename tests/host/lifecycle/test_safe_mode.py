"""Safe mode: after daemons died again and again, or by order, payloads are left alone; then not."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from tests.host.lifecycle.states import AT, active, after, at_step, drive, found, way_to_active
from tests.kit.golden import Golden

from nondum.host.core import effects
from nondum.host.core.events.daemon import HostStable, HostStarted, SafeModeEntered, SafeModeLeft
from nondum.host.core.events.drives import DriveRead, DriveRemoved
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import safe_mode
from nondum.host.lifecycle.recovery import recover
from nondum.host.manager import crash_loop
from nondum.host.manager.crash_loop import CrashCounter

SAFE = (Safety.INITIAL, Safety.NOTHING)
STARTING = (effects.ProbeComponents, effects.ReadDrive, effects.CopyPayload)


def safely(state: HostState, safety: Safety = Safety.INITIAL) -> tuple[HostState, set[type]]:
    """What a daemon in safe mode makes of a state, and of the drive that is still in."""
    recovered = recover(state, AT, safety=safety)
    state, done = after(drive(), state=recovered.state)
    return state, {type(effect) for effect in (*recovered.effects, *done)}


def installed() -> HostState:
    read = DriveRead("a", ("k1",))
    return after(drive("a", "installed"), *way_to_active(), read)[0]


@pytest.mark.parametrize("safety", SAFE)
@pytest.mark.parametrize("step", [Step.STORED, Step.PROBED, Step.ACTIVE, Step.SUPERSEDED])
def test_guests_are_left_alone_wherever_they_were(step: Step, safety: Safety) -> None:
    state, done = safely(at_step(step), safety)
    assert state.payloads["k1"].step is Step.QUARANTINED
    assert [problem.code for problem in state.payloads["k1"].problems] == ["SAFE_MODE"]
    assert not state.components
    assert not done & set(STARTING)


def test_releases_that_wait_do_not_come_forward_instead() -> None:
    state, done = safely(at_step(Step.SUPERSEDED))
    assert {payload.step for payload in state.payloads.values()} == {Step.QUARANTINED}
    assert not done & set(STARTING)


def test_what_is_installed_for_good_is_at_work_until_that_kills_daemons_too() -> None:
    recovered = recover(installed(), AT, safety=Safety.INITIAL)
    assert recovered.state.payloads["k1"].step is Step.STORED
    assert any(isinstance(effect, effects.ProbeComponents) for effect in recovered.effects)
    recovered = recover(installed(), AT, safety=Safety.NOTHING)
    assert recovered.state.payloads["k1"].step is Step.QUARANTINED
    assert not any(isinstance(effect, effects.ProbeComponents) for effect in recovered.effects)


def test_it_is_told_as_the_daemon_starts_and_why(golden: Golden) -> None:
    outcome = recover(HostState("spot"), AT, safety=Safety.INITIAL, why="it rained")
    (entered,) = [e for e in outcome.events if isinstance(e, SafeModeEntered)]
    assert entered.problems[0].code == safe_mode.CODE
    golden.check("safe mode is entered", str(entered.problems[0]), why="it rained")
    assert outcome.state.snapshot().safety is Safety.INITIAL


@pytest.mark.parametrize("kind", ["slot", "block", "placed"])
def test_drives_are_not_looked_at(kind: str) -> None:
    state = recover(HostState("spot"), AT, safety=Safety.INITIAL).state
    state, done = after(drive("b", kind), state=state)
    assert not any(isinstance(effect, effects.ReadDrive) for effect in done)
    assert [problem.code for problem in state.drives["b"].problems] == ["SAFE_MODE"]


def test_payload_of_a_drive_is_refused_in_any_case() -> None:
    state = recover(HostState("spot"), AT, safety=Safety.INITIAL).state
    state, _ = after(drive("b"), found("k2", "b"), state=state)
    assert state.payloads["k2"].step is Step.REFUSED
    assert [problem.code for problem in state.payloads["k2"].problems] == ["SAFE_MODE"]


def test_payload_that_is_installed_now_is_taken_in() -> None:
    state = recover(HostState("spot"), AT, safety=Safety.INITIAL).state
    state, done = after(drive("a", "installed"), *way_to_active()[:1], state=state)
    assert any(isinstance(effect, effects.ReadDrive) for effect in done)
    assert state.payloads["k1"].step is Step.RECEIVED


def test_drive_that_is_pulled_takes_its_payloads_along() -> None:
    state, _ = safely(active())
    state, _ = after(DriveRemoved("a"), state=state)
    assert state.payloads["k1"].step is Step.REMOVING


def test_one_payload_may_be_tried_by_order() -> None:
    state, _ = safely(active())
    state, done = after(RetryAsked("k1"), state=state)
    assert state.payloads["k1"].step is Step.STORED
    assert state.safety is Safety.INITIAL
    assert any(isinstance(effect, effects.ProbeComponents) for effect in done)


def test_all_is_taken_in_again_once_it_is_left() -> None:
    """And the host checks again whether the payloads are trusted."""
    state, _ = safely(active())
    state, done = after(SafeModeLeft("spot"), state=state)
    assert state.safety is Safety.OFF
    assert state.payloads["k1"].step is Step.STORED
    assert state.drives["a"].state is DriveState.READING
    assert {effects.ProbeComponents, effects.ReadDrive} <= {type(effect) for effect in done}
    assert effects.JudgePayloads(("k1",)) in done
    again, done = after(SafeModeLeft("spot"), state=state)
    assert (again, done) == (state, [])


def test_what_was_quarantined_before_stays_so_when_it_is_left() -> None:
    state, _ = safely(at_step(Step.QUARANTINED))
    assert [p.code for p in state.payloads["k1"].problems] == ["TEST"]
    state, _ = after(SafeModeLeft("spot"), state=state)
    assert state.payloads["k1"].step is Step.QUARANTINED


def test_next_daemon_is_as_always() -> None:
    state, _ = safely(active())
    recovered = recover(state, AT)
    assert recovered.state.payloads["k1"].step is Step.STORED
    assert recovered.state.payloads["k1"].problems == ()
    assert not any(isinstance(event, SafeModeEntered) for event in recovered.events)


def test_of_two_releases_the_next_daemon_starts_one() -> None:
    state, _ = safely(at_step(Step.SUPERSEDED))
    recovered = recover(state, AT).state
    assert sorted(p.step.name for p in recovered.payloads.values()) == ["STORED", "SUPERSEDED"]


def test_deaths_that_were_counted_before_are_counted_on_afterwards() -> None:
    """A drive that was not looked at has not proved anything."""
    state = recover(after(drive())[0], AT).state
    assert state.tries == {"slot:a": 1}
    state, _ = safely(state)
    state, _ = after(HostStable("spot"), state=state)
    assert state.tries == {"slot:a": 1}


# Which daemon it is


def died(state: Path, times: int) -> None:
    for _ in range(times):
        CrashCounter(state).begin()


@pytest.mark.parametrize(
    ("deaths", "safety"),
    [
        (0, Safety.OFF),
        (safe_mode.DEATHS - 1, Safety.OFF),
        (safe_mode.DEATHS, Safety.INITIAL),
        (safe_mode.MORE_DEATHS - 1, Safety.INITIAL),
        (safe_mode.MORE_DEATHS, Safety.NOTHING),
        (5 * safe_mode.MORE_DEATHS, Safety.NOTHING),
    ],
)
def test_so_many_deaths_in_a_row_call_for_it(tmp_path: Path, deaths: int, safety: Safety) -> None:
    died(tmp_path, deaths)
    found, why = CrashCounter(tmp_path).begin()
    assert found is safety
    assert bool(why) == (safety is not Safety.OFF)


def test_daemon_that_lived_long_enough_clears_it(tmp_path: Path) -> None:
    died(tmp_path, safe_mode.DEATHS)
    CrashCounter(tmp_path).clear()
    assert CrashCounter(tmp_path).begin()[0] is Safety.OFF


@pytest.mark.anyio
async def test_the_while_begins_once_it_serves(tmp_path: Path) -> None:
    died(tmp_path, safe_mode.DEATHS)
    counter = CrashCounter(tmp_path, soon_s=0.0)
    counter.begin()
    counter.on_event(HostStarted("spot"))
    await counter.outlive()
    assert CrashCounter(tmp_path).begin()[0] is Safety.OFF


def test_people_ask_for_it_by_a_file(tmp_path: Path) -> None:
    (tmp_path / "safe").touch()
    assert CrashCounter(tmp_path).begin() == (Safety.INITIAL, f"there is {tmp_path}/safe")
    (tmp_path / "safe").write_text("nothing\n", encoding="ascii")
    assert CrashCounter(tmp_path).begin()[0] is Safety.NOTHING


def test_people_ask_for_it_as_they_start_it(tmp_path: Path) -> None:
    assert CrashCounter(tmp_path).begin(Safety.NOTHING)[0] is Safety.NOTHING


@pytest.mark.parametrize(
    ("words", "safety"),
    [
        ("", Safety.OFF),
        ("quiet nondum.safely root=/dev/vda", Safety.OFF),
        ("quiet nondum.safe", Safety.INITIAL),
        ("nondum.safe=1 quiet", Safety.INITIAL),
        ("nondum.safe=nothing\n", Safety.NOTHING),
    ],
)
def test_people_ask_for_it_on_the_kernels_command_line(words: str, safety: Safety) -> None:
    assert safe_mode.asked_of_kernel(words) is safety


def test_folder_that_cannot_be_written_is_no_reason_not_to_start(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert CrashCounter(tmp_path / "none").begin()[0] is Safety.OFF
    [record] = caplog.records
    assert (record.levelno, record.name) == (logging.WARNING, crash_loop.__name__)


@pytest.mark.parametrize("text", ["", "many", "-3", "\xff", "99999999999999999999"])
def test_count_that_is_none_is_taken_for_what_it_is_worth(tmp_path: Path, text: str) -> None:
    (tmp_path / "deaths").write_text(text, encoding="latin-1")
    assert isinstance(CrashCounter(tmp_path).begin()[0], Safety)
