"""A payload that is built again on a drive that stays plugged in: its old release goes on until the
new one is active, and is then gone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from tests.host.lifecycle.states import AT, PROBLEM, after, drive, found, way_to_active
from tests.kit.host import LAMP, host_in_process, left_over
from tests.kit.payloads import Part, make_payload

from nondum.host.core.events.drives import DriveRead, DriveRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadFound, PayloadRefused, PayloadWithdrawn
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.advance import advance
from nondum.host.workers.spec import Timing
from nondum.sdk.errors import Problem
from nondum.wheelhouse.build import build

SCANNED = DriveRead("a", ("k2",))
UNSIGNED = Problem("SIG_MISSING", "made up")
LAMP_ID = "org.example.lamp"


def at_work() -> HostState:
    """A payload is active, and another release lies in its place on its drive."""
    state, _ = after(drive(), *way_to_active("k1"), DriveRead("a", ("k1",)))
    state, _ = after(drive(), found("k2", release=2), SCANNED, state=state)
    return state


def steps(state: HostState) -> dict[str, Step]:
    return {key: payload.step for key, payload in state.payloads.items()}


def test_the_old_release_goes_on_while_the_new_one_is_installed() -> None:
    assert steps(at_work()) == {"k1": Step.ACTIVE, "k2": Step.RECEIVED}


def test_the_old_release_is_withdrawn_once_the_new_one_is_in_force() -> None:
    state, _ = after(*way_to_active("k2")[1:], state=at_work())
    assert steps(state) == {"k1": Step.REMOVING, "k2": Step.ACTIVE}


@pytest.mark.parametrize("problem", [PROBLEM, UNSIGNED], ids=["wrong", "unsigned"])
def test_the_old_release_goes_on_where_the_new_one_is_refused(problem: Problem) -> None:
    state, _ = after(PayloadRefused("k2", (problem,)), state=at_work())
    state, _ = after(drive(), found("k3", release=3), DriveRead("a", ("k3",)), state=state)
    assert steps(state) == {"k1": Step.ACTIVE, "k2": Step.REMOVING, "k3": Step.RECEIVED}


def test_the_old_release_goes_with_the_drive() -> None:
    state, _ = after(DriveRemoved("a"), state=at_work())
    assert steps(state) == {"k1": Step.REMOVING, "k2": Step.REMOVING}


LATER: dict[str, Callable[[], Event]] = {
    "nothing": lambda: DriveRead("a", ()),
    "another payload": lambda: DriveRead("a", ("k9",)),
}


@pytest.mark.parametrize("read", LATER.values(), ids=LATER)
def test_what_nothing_lies_in_the_place_of_is_withdrawn(read: Callable[[], Event]) -> None:
    state, _ = after(drive(), *way_to_active("k1"), DriveRead("a", ("k1",)))
    other = found("k9", payload_id="org.other")
    state, _ = after(drive(), other, read(), state=state)
    assert steps(state)["k1"] is Step.REMOVING


def test_what_is_being_copied_is_withdrawn_at_once() -> None:
    """What it was to be copied from is not there any more."""
    state, _ = after(drive(), found("k1"), DriveRead("a", ("k1",)))
    state, _ = after(drive(), found("k2", release=2), SCANNED, state=state)
    assert steps(state) == {"k1": Step.REMOVING, "k2": Step.RECEIVED}


@pytest.mark.parametrize("problem", [PROBLEM, UNSIGNED], ids=["wrong", "unsigned"])
def test_what_was_refused_and_rebuilt_is_told_so_and_then_judged(problem: Problem) -> None:
    """That it was rebuilt comes first, also where the new one is refused as soon as it is found."""
    state, _ = after(drive(), found("k1"), PayloadRefused("k1", (PROBLEM,)))
    state, _ = after(drive(), state=state)
    outcome = advance(state, replace(found("k2", release=2), problems=(problem,)), AT)
    told = [event for event in outcome.events if not isinstance(event, PayloadFound)]
    assert told[:2] == [
        PayloadWithdrawn("k1", "it was built again in its place", "k2"),
        PayloadRefused("k2", (problem,)),
    ]
    assert steps(outcome.state) == {"k1": Step.REMOVING, "k2": Step.REFUSED}


def test_what_was_rebuilt_on_one_of_its_drives_stays_for_the_other() -> None:
    state, _ = after(drive(), drive("b"), found("k1"), found("k1", "b"))
    state, _ = after(PayloadRefused("k1", (PROBLEM,)), state=state)
    state, _ = after(drive(), found("k2", release=2), SCANNED, state=state)
    assert steps(state) == {"k1": Step.REFUSED, "k2": Step.RECEIVED}
    assert [*state.payloads["k1"].sources] == ["b"]


def test_a_release_on_a_drive_of_its_own_stays() -> None:
    state, _ = after(drive("b"), *way_to_active("k1", "b"), DriveRead("b", ("k1",)))
    state, _ = after(drive(), found("k2", release=2), SCANNED, state=state)
    state, _ = after(*way_to_active("k2")[1:], state=state)
    assert steps(state) == {"k1": Step.SUPERSEDED, "k2": Step.ACTIVE}


@pytest.mark.parametrize(
    ("refused", "told", "step"),
    [
        pytest.param((UNSIGNED,), (), Step.REMOVING, id="signed since"),
        pytest.param((UNSIGNED,), (UNSIGNED,), Step.REFUSED, id="still not signed"),
        pytest.param((PROBLEM,), (), Step.REFUSED, id="refused for something else"),
        pytest.param((UNSIGNED, PROBLEM), (), Step.REFUSED, id="for both"),
    ],
)
def test_what_was_refused_for_its_signatures_is_tried_again_once_it_is_signed(
    refused: tuple[Problem, ...], told: tuple[Problem, ...], step: Step
) -> None:
    state, _ = after(drive(), found("k1"), PayloadRefused("k1", refused))
    again = found("k1")
    again = PayloadFound(
        *(again.payload, again.drive, again.folder, again.digest, "org.x", "1.0", 1), problems=told
    )
    state, _ = after(drive(), again, DriveRead("a", ("k1",)), state=state)
    assert steps(state) == {"k1": step}


@pytest.mark.anyio
async def test_building_into_the_slot_upgrades(tmp_path: Path) -> None:
    """Nothing of the old release is left, not even as something to go back to."""
    slot = tmp_path / "drive"
    built = partial(lamp, tmp_path, slot)
    built(1)
    async with host_in_process(tmp_path, timing=Timing(startup_s=20.0, settle_beats=0)) as host:
        host.plug(slot)
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        for number in (2, 3):
            revision = host.snapshot.revision
            built(number)
            wanted = {f"r{number - 1}": None, f"r{number}": Step.ACTIVE}
            await host.until_releases(LAMP_ID, **wanted)
            assert host.snapshot.revision == revision + 1, "it was never without the lamp"
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not left_over(host.folders)


@pytest.mark.anyio
async def test_a_slot_that_loses_its_folder_is_pulled(tmp_path: Path) -> None:
    lamp(tmp_path, tmp_path / "drive", 1)
    async with host_in_process(tmp_path, timing=Timing(startup_s=20.0, settle_beats=0)) as host:
        host.plug(tmp_path / "drive")
        await host.until_releases(LAMP_ID, r1=Step.ACTIVE)
        (tmp_path / "drive").rename(tmp_path / "elsewhere")
        await host.until_gone(LAMP_ID)
        assert not host.snapshot.drives


def lamp(root: Path, drive: Path, release: int) -> None:
    """Put a release of the lamp on a drive, as `payload build` does."""
    version = f"{release}.0"
    part = Part("lamp", LAMP, version=version)
    made = root / f"made-{release}"
    folder = make_payload(made, part, payload_id=LAMP_ID, version=version, release=release)
    build.deliver(folder, drive)
