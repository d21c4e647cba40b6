"""Components and plugins of which two payloads have one name: what this host calls them."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.host.lifecycle.states import AT, active, after, component, drive, found, way_to_active

from nondum.host.core import effects
from nondum.host.core.events.drives import DriveRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    ComponentsProbed,
    ForgetAsked,
    PayloadActivated,
    PayloadCleared,
    PayloadCopied,
    PayloadRefused,
    PayloadVerified,
)
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle.recovery import recover

OTHER = "eye--org-y"
"""What `eye` of the payload `org.y` is called beside that of `org.x`."""


def second(key: str = "k2", drive: str = "b", words: str = "") -> list[Event]:
    """The way of another maker's payload whose component has the id `eye` as well."""
    return way_to_active(key, drive, payload_id="org.y", words=words, called=OTHER)


def both(words: str = "") -> HostState:
    return after(drive("b"), *second(words=words), state=active())[0]


def pulled(drive: str, key: str) -> tuple[Event, ...]:
    return DriveRemoved(drive), PayloadCleared(key)


def test_two_payloads_with_a_component_of_one_id_are_active_together() -> None:
    state = both()
    assert {p.step for p in state.payloads.values()} == {Step.ACTIVE}
    assert {id: c.payload_id for id, c in state.components.items()} == {
        "eye": "org.x",
        OTHER: "org.y",
    }
    assert state.payloads["k2"].names == {"eye": OTHER}


def test_its_workers_are_started_by_that_name() -> None:
    _, done = after(drive("b"), *second(), state=active())
    [stored] = (e for e in done if isinstance(e, effects.StoreWheels))
    [probed] = (e for e in done if isinstance(e, effects.ProbeComponents))
    assert stored.renamed == probed.renamed == {"eye": OTHER}
    _, done = after(*pulled("b", "k2"), state=both())
    assert effects.CachePayload("k2", (OTHER,)) in done


def test_a_payload_holds_its_names_until_its_workers_have_ended() -> None:
    state, _ = after(DriveRemoved("a"), drive("b"), *second()[:3], state=active())
    assert state.payloads["k2"].components == (OTHER,)


def test_one_that_was_never_active_and_has_gone_holds_none() -> None:
    state, _ = after(drive("a"), *way_to_active()[:3], *pulled("a", "k1"))
    state, _ = after(drive("b"), *second()[:3], state=state)
    assert state.payloads["k2"].components == ("eye",)


def test_one_that_was_refused_holds_none() -> None:
    refused = PayloadRefused("k1", ())
    state, _ = after(drive("a"), *way_to_active()[:3], refused)
    state, _ = after(drive("b"), *second()[:3], state=state)
    assert state.payloads["k2"].components == ("eye",)


@pytest.mark.parametrize("gone", [("a", "k1"), ("b", "k2")], ids=["the first", "the second"])
def test_pulling_one_changes_no_name(gone: tuple[str, str]) -> None:
    state, _ = after(*pulled(*gone), state=both())
    left = "eye" if gone[1] == "k2" else OTHER
    assert [*state.components] == [left]
    back = second() if gone[1] == "k2" else way_to_active()
    state, _ = after(drive(gone[0]), *back, state=state)
    assert {*state.components} == {"eye", OTHER}


def test_order_of_plugging_changes_no_name() -> None:
    gone, _ = after(*pulled("a", "k1"), *pulled("b", "k2"), state=both())
    state, _ = after(drive("b"), *second(), state=gone)
    assert [*state.components] == [OTHER]
    state, _ = after(drive("a"), *way_to_active(), state=state)
    assert {id: c.payload_id for id, c in state.components.items()} == {
        OTHER: "org.y",
        "eye": "org.x",
    }


def test_a_daemon_that_starts_brings_each_up_by_its_name() -> None:
    outcome = recover(both(), AT)
    probed = {
        e.payload: e.renamed for e in outcome.effects if isinstance(e, effects.ProbeComponents)
    }
    assert probed == {"k1": {}, "k2": {"eye": OTHER}}


@pytest.mark.parametrize(
    ("payload_id", "called"), [("org.x", "eye"), ("org.y", OTHER)], ids=["the first", "the second"]
)
def test_a_new_release_has_the_names_of_the_one_before(payload_id: str, called: str) -> None:
    way = way_to_active("k3", "c", payload_id=payload_id, called=called)
    way[0] = found("k3", "c", payload_id=payload_id, release=2)
    state, _ = after(drive("c"), *way, state=both())
    assert state.components[called].payload == "k3"
    assert {*state.components} == {"eye", OTHER}


def test_two_releases_that_come_in_together_have_one_name() -> None:
    newer = way_to_active("k3", "c", payload_id="org.y", called=OTHER)[:3]
    newer[0] = found("k3", "c", payload_id="org.y", release=2)
    state, _ = after(drive("b"), drive("c"), *second()[:3], *pulled("a", "k1"), state=active())
    state, _ = after(ForgetAsked("org.x"), *newer, state=state)
    assert state.payloads["k3"].components == state.payloads["k2"].components == (OTHER,)


def test_a_component_that_comes_with_a_release_gets_a_name_then() -> None:
    before, _ = after(
        drive("c"), *way_to_active("k9", "c", "arm", payload_id="org.z"), state=active()
    )
    newer = [found("k2", "b", release=2), PayloadCopied("k2")]
    verified = PayloadVerified("k2", ("eye", "arm"))
    state, _ = after(drive("b"), *newer, verified, state=before)
    assert state.payloads["k2"].names == {"eye": "eye", "arm": "arm--org-x"}


def test_own_name_is_free_while_its_payload_is_away() -> None:
    gone, _ = after(*pulled("a", "k1"), state=active())
    assert not gone.names
    state, _ = after(drive("b"), *way_to_active("k2", "b", payload_id="org.y"), state=gone)
    assert state.payloads["k2"].components == ("eye",)
    state, _ = after(drive("a"), *way_to_active()[:3], state=state)
    assert state.payloads["k1"].components == ("eye--org-x",)


def test_a_forgotten_payload_gives_up_its_other_name() -> None:
    gone, _ = after(*pulled("a", "k1"), *pulled("b", "k2"), state=both())
    forgotten, _ = after(ForgetAsked("org.y"), state=gone)
    kept, _ = after(drive("b"), *second()[:3], state=gone)
    free, _ = after(drive("b"), *second()[:3], state=forgotten)
    assert kept.payloads["k2"].components == (OTHER,)
    assert free.payloads["k2"].components == ("eye",)


# Plugins


@pytest.mark.parametrize(("words", "plugin"), [("", "eye"), ("look", OTHER)], ids=["same", "other"])
def test_plugins_share_their_name_only_if_they_say_the_same(words: str, plugin: str) -> None:
    state = both(words)
    assert state.components["eye"].description.name == "eye"
    assert state.components[OTHER].description.name == plugin
    assert state.names["org.y"].plugins == ({"eye": plugin} if plugin != "eye" else {})


def test_a_plugin_keeps_its_name_when_the_other_one_is_gone() -> None:
    gone, _ = after(*pulled("a", "k1"), *pulled("b", "k2"), state=both("look"))
    state, _ = after(drive("b"), *second(words="look"), state=gone)
    assert state.components[OTHER].description.name == OTHER


def test_a_release_that_says_something_new_by_a_shared_name_gets_its_own() -> None:
    newer = way_to_active("k3", "c", words="look")
    newer[0] = found("k3", "c", release=2)
    state, _ = after(drive("c"), *newer, state=both())
    assert state.components["eye"].description.name == "eye--org-x"
    assert state.components[OTHER].description.name == "eye"


PAYLOADS = {"org.x": "k1", "org.y": "k2", "org.x-y": "k3", "org.x.y": "k4"}


@settings(max_examples=60)
@given(st.lists(st.tuples(st.sampled_from(list(PAYLOADS)), st.booleans()), max_size=12))
def test_whatever_comes_and_goes_no_two_have_one_name_and_none_changes_it(
    happened: list[tuple[str, bool]],
) -> None:
    """Each payload is plugged in if it is not there, else pulled, or the daemon starts again."""
    state, told = HostState("spot"), dict[str, str]()
    for payload_id, restarts in happened:
        key = PAYLOADS[payload_id]
        if restarts:
            state = recover(state, AT).state
            for one in [p for p in state.payloads.values() if p.step is Step.STORED]:
                entered = component(payload=one.key, called=one.components[0])
                activated = PayloadActivated(one.key, (entered,))
                state, _ = after(ComponentsProbed(one.key), activated, state=state)
        elif key in state.payloads:
            state, _ = after(*pulled(key, key), state=state)
            if told[payload_id] == "eye":  # its own is free then
                del told[payload_id]
        else:
            way = way_to_active(key, key, payload_id=payload_id)
            state, _ = after(drive(key), *way[:-1], state=state)
            entered = component(payload=key, called=state.payloads[key].components[0])
            state, _ = after(PayloadActivated(key, (entered,)), state=state)
        active = [p for p in state.payloads.values() if p.step is Step.ACTIVE]
        assert len(state.components) == len(active)
        for one in active:
            [name] = one.components
            assert told.setdefault(one.payload_id, name) == name
            assert state.components[name].payload_id == one.payload_id
    assert len({*told.values()}) == len(told)


def test_a_plugin_s_other_name_stays_its_payload_s_while_that_is_away() -> None:
    """Of `org.y-z` and `org.y.z` the name of a second plugin would be the same."""
    before, _ = after(
        drive("b"),
        *way_to_active("k2", "b", payload_id="org.y-z", words="look", called="eye--org-y-z"),
        *pulled("b", "k2"),
        state=active(),
    )
    assert before.names["org.y-z"].plugins == {"eye": "eye--org-y-z"}
    other = way_to_active("k3", "c", payload_id="org.y.z", words="other", called="it")
    state, _ = after(drive("c"), *other, state=before)
    assert state.components["it"].description.name.startswith("eye--org-y-z--")
