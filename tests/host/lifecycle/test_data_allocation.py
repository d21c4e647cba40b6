"""Which data are shown to which component: late, early and shared ones, several that would do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from tests.host.lifecycle.states import after, drive, found, way_to_active

from nondum.host.core.effects import Effect, HideData, RestartWorker, ShowData
from nondum.host.core.events.data import DataShown, DataWithdrawn
from nondum.host.core.events.drives import DriveRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import PayloadActivated, PayloadVerified
from nondum.host.core.events.workers import WorkerFailed
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.data import DataClaim, DataRecord
from nondum.host.core.state import HostState
from nondum.host.lifecycle.advance import advance
from nondum.sdk.errors import Problem
from nondum.wheelhouse.format.data import DataNeed

WEIGHTS = DataNeed("weights", kind="gguf")


def data(payload: str, version: str = "1", name: str = "tiny", kind: str = "gguf") -> DataRecord:
    return DataRecord(payload, "", name, kind, version, Path("/d") / payload, ("a.gguf",), 3)


def bringing(key: str, brought: DataRecord, of: str = "", release: int = 1) -> list[Event]:
    """A drive named like the payload that brings nothing but data; it may be a release `of` one."""
    *way, _ = way_to_active(key, key)
    way[0] = found(key, key, payload_id=f"org.{of or key}", release=release)
    way[2] = PayloadVerified(key, ())
    return [drive(key), *way, PayloadActivated(key, (), data=(brought,))]


def needing(*needs: DataNeed, key: str = "k1", id: str = "eye") -> list[Event]:
    *way, activated = way_to_active(key, key, id, payload_id=f"org.{key}")
    assert isinstance(activated, PayloadActivated)
    claims = tuple(DataClaim(need) for need in needs)
    components = tuple(replace(c, data=claims) for c in activated.components)
    return [drive(key), *way, replace(activated, components=components)]


def shown(state: HostState, id: str = "eye") -> dict[str, str | None]:
    return {claim.need.name: claim.data for claim in state.components[id].data}


def of_data(effects: Sequence[Effect]) -> list[Effect]:
    return [effect for effect in effects if isinstance(effect, ShowData | HideData)]


def test_data_that_are_here_are_shown_to_a_component_that_comes() -> None:
    state, done = after(*bringing("d1", data("d1")), *needing(WEIGHTS))
    assert shown(state) == {"weights": "d1/tiny"}
    assert of_data(done) == [ShowData("eye", "k1", "weights", state.data["d1/tiny"])]
    assert state.data["d1/tiny"].payload_id == "org.d1"


def test_data_that_come_late_make_a_component_ready() -> None:
    state, done = after(*needing(WEIGHTS))
    assert (shown(state), of_data(done)) == ({"weights": None}, [])
    assert (state.components["eye"].is_ready, state.components["eye"].missing) == (
        False,
        ("weights",),
    )
    state, done = after(*bringing("d1", data("d1")), state=state)
    assert of_data(done) == [ShowData("eye", "k1", "weights", state.data["d1/tiny"])]
    assert state.components["eye"].is_ready


def test_data_that_are_pulled_are_hidden_in_the_same_turn() -> None:
    state, _ = after(*needing(WEIGHTS), *bringing("d1", data("d1")))
    outcome = advance(state, DriveRemoved("d1"), after(drive())[0].drives["a"].since)
    assert not outcome.state.data
    assert of_data(outcome.effects) == [HideData("eye", "k1", "weights")]
    assert DataWithdrawn("d1/tiny", "eye", "weights") in outcome.events
    assert not outcome.state.components["eye"].is_ready
    assert outcome.state.revision == state.revision + 1


def test_a_component_that_can_do_without_is_ready_all_the_same() -> None:
    state, _ = after(*needing(replace(WEIGHTS, optional=True)))
    assert state.components["eye"].is_ready


def test_the_highest_version_that_fits_is_shown() -> None:
    need = replace(WEIGHTS, version="<10")
    offers = [data("d1", "2"), data("d2", "9.1"), data("d3", "10"), data("d4", "9.0")]
    state, _ = after(*(event for d in offers for event in bringing(d.payload, d)), *needing(need))
    assert shown(state) == {"weights": "d2/tiny"}


def test_what_is_shown_stays_when_something_newer_comes() -> None:
    state, _ = after(*bringing("d1", data("d1")), *needing(WEIGHTS))
    state, done = after(*bringing("d2", data("d2", "2", name="large")), state=state)
    assert (shown(state), of_data(done)) == ({"weights": "d1/tiny"}, [])


def test_other_data_take_the_place_of_those_that_are_pulled() -> None:
    state, _ = after(*bringing("d1", data("d1")), *needing(WEIGHTS))
    state, _ = after(*bringing("d2", data("d2", name="large")), state=state)
    state, done = after(DriveRemoved("d1"), state=state)
    assert shown(state) == {"weights": "d2/large"}
    assert of_data(done) == [ShowData("eye", "k1", "weights", state.data["d2/large"])]


def test_a_newer_release_of_a_payload_takes_over_what_the_older_one_showed() -> None:
    state, _ = after(*bringing("d1", data("d1")), *needing(WEIGHTS))
    newer = bringing("d2", data("d2", "2"), of="d1", release=2)
    outcome_state, done = after(*newer, state=state)
    assert shown(outcome_state) == {"weights": "d2/tiny"}
    assert of_data(done) == [ShowData("eye", "k1", "weights", outcome_state.data["d2/tiny"])]


def test_several_components_are_shown_the_same_data() -> None:
    state, _ = after(*bringing("d1", data("d1")), *needing(WEIGHTS))
    state, _ = after(*needing(DataNeed("w", data="tiny"), key="k2", id="mic"), state=state)
    assert shown(state) == {"weights": "d1/tiny"}
    assert shown(state, "mic") == {"w": "d1/tiny"}


def test_a_component_that_was_given_up_is_tried_again_once_it_has_its_data() -> None:
    state, _ = after(*needing(WEIGHTS))
    state, _ = after(WorkerFailed("eye", (Problem("TEST", "made up"),), "k1"), state=state)
    assert state.components["eye"].state is ComponentState.QUARANTINED
    state, done = after(*bringing("d1", data("d1")), state=state)
    assert state.components["eye"].state is not ComponentState.QUARANTINED
    assert RestartWorker("eye") in done


@given(st.permutations(["d1", "d2", "d3", "k1", "k2"]), st.data())
def test_whatever_comes_and_goes_each_need_that_can_be_met_is(
    order: list[str], choose: st.DataObject
) -> None:
    offers = {
        "d1": data("d1", "1"),
        "d2": data("d2", "2", "large"),
        "d3": data("d3", "3", "x", "y"),
    }
    state, told = HostState("spot"), dict[str, str | None]()

    def happen(event: Event) -> None:
        nonlocal state
        state, effects, events = advance(state, event, after(drive())[0].drives["a"].since)
        for one in events:
            if isinstance(one, DataShown):
                told[one.component] = one.data
            if isinstance(one, DataWithdrawn):
                told[one.component] = None
        assert all(
            effect.data.id in state.data for effect in effects if isinstance(effect, ShowData)
        )

    for name in order:
        way = (
            bringing(name, offers[name]) if name in offers else needing(WEIGHTS, key=name, id=name)
        )
        for event in way:
            happen(event)
        if choose.draw(st.booleans()):
            happen(DriveRemoved(choose.draw(st.sampled_from(order))))
        for component in state.components.values():
            (claim,) = component.data
            fits = [d.id for d in state.data.values() if d.kind == "gguf"]
            assert (claim.data in fits) if fits else claim.data is None
            assert told.get(component.id) == claim.data
