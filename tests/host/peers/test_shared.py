"""What one host offers is what another one understands, whatever a third one makes up."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.host.peers.watcher import HEAD, component, merged_watcher, no_claims, snapshot

from nondum.host.core.events.facts import FactForgotten, FactKnown, StreamFlowing
from nondum.host.core.records.device import DeviceClaim
from nondum.host.peers import peer_entries
from nondum.host.peers.offered_entries import Policy, catalogue_entries, changes, passing
from nondum.host.peers.peer_entries import (
    BELOW_OWN,
    Introduced,
    claims_of,
    reach_of,
    record_of,
    taken_in,
    withdrawal,
)
from nondum.host.peers.uses import taken_by
from nondum.sdk.description import Unit

ME = Introduced("key", "mule", "tcp://10.0.0.2:7410", "pairing", "1f")


def test_what_is_offered_is_understood() -> None:
    entries = {
        **catalogue_entries(snapshot(component()), Policy(frozenset({"watcher"}))),
        "compute": {"processors": 4},
    }
    record = record_of(ME, entries)
    (offered,) = record.components
    assert offered.id == "watcher@mule"
    assert (offered.is_ready, offered.rank, offered.life) == (True, BELOW_OWN + 3, "1f")
    assert offered.description == component().description
    assert (record.compute, record.problems) == ({"processors": 4}, ())
    assert {mount.unit for mount in record.mounts} == {
        "mule__watcher__eye",
        "mule__watcher__head",
    }


def test_component_with_a_name_of_its_host_is_one_like_any_other() -> None:
    name = "watcher--org-example-south"
    told = {
        f"component/{name}": catalogue_entries(snapshot(component()), Policy())[
            "component/watcher"
        ],
        f"device/{name}": {"component": name},
    }
    record = record_of(ME, told)
    assert [one.id for one in record.components] == [f"{name}@mule"]
    assert (record.devices, record.problems) == ({name: f"{name}@mule"}, ())


def test_actuators_are_withheld_and_with_them_what_only_they_do() -> None:
    (offered,) = record_of(ME, catalogue_entries(snapshot(component()), Policy())).components
    assert [unit.name for unit in offered.description.units] == ["eye"]
    assert (offered.abilities, offered.withheld) == (("look",), ("head",))
    record = record_of(ME, catalogue_entries(snapshot(component()), Policy()))
    assert [mount.unit for mount in record.mounts] == ["mule__watcher__eye"]


def test_component_of_withheld_units_only_brings_words() -> None:
    alone = component("watcher", HEAD)
    (offered,) = record_of(ME, catalogue_entries(snapshot(alone), Policy())).components
    assert (offered.abilities, offered.withheld) == ((), ("head",))
    assert offered.description == replace(alone.description, units=())


def test_type_of_actuator_that_a_plugin_declares_is_withheld_too() -> None:
    crane = component("watcher", Unit("boom", "crane"))
    policy = Policy(actuators=frozenset({"arm", "crane"}))
    (offered,) = record_of(ME, catalogue_entries(snapshot(crane), policy)).components
    assert offered.withheld == ("boom",)


def test_devices_that_serve_a_component_are_told() -> None:
    served = component(devices=(DeviceClaim("port", {}, optional=False, device="usb1"),))
    assert record_of(ME, catalogue_entries(snapshot(served), Policy())).devices == {
        "usb1": "watcher@mule"
    }


def test_what_a_component_says_is_told_with_full_names_and_taken_back() -> None:
    said = (
        FactKnown("watcher", "sees", ("eye", "self")),
        StreamFlowing("watcher", "mule__watcher__image", flowing=True),
    )
    entries = passing(snapshot(component()), Policy(), lambda _: said, {})
    known, flows = sorted((claim for _, claim in claims_of("mule", entries)), key=str)
    assert known == FactKnown("watcher@mule", "sees", ("mule__watcher__eye", "mule"))
    assert flows == StreamFlowing("watcher@mule", "mule__watcher__image", flowing=True)
    assert withdrawal(known) == FactForgotten(
        "watcher@mule", "sees", ("mule__watcher__eye", "mule")
    )
    assert withdrawal(flows) == StreamFlowing("watcher@mule", "mule__watcher__image", flowing=False)


def test_units_in_use_are_told_to_all_peers_but_the_one_that_they_serve() -> None:
    taken = {"idle mule__watcher__head": "rover", "free mule__watcher__image": "mule"}
    entries = passing(snapshot(component()), Policy(), no_claims, taken)
    assert taken_in("mule", entries, "scout") == taken
    assert taken_in("mule", entries, "rover") == {"free mule__watcher__image": "mule"}


@pytest.mark.parametrize(
    "text", ["idle rover__base__base", "on mule__watcher__eye mule", "idle", "self mule"]
)
def test_peer_takes_nothing_but_its_own(text: str) -> None:
    assert taken_in("mule", {f"taken/{text}": {"by": "mule"}}, "rover") == {}


def test_streams_are_fetched_at_addresses_only() -> None:
    said = {"reach": {"hosts": ["10.0.0.7", "fd00::7", "router.example", 7, "10.0.0.7:80"]}}
    assert reach_of(said) == ("10.0.0.7", "[fd00::7]")
    assert reach_of({"reach": {"hosts": "10.0.0.7"}}) == reach_of({}) == ()


def test_peer_speaks_of_its_own_streams_only() -> None:
    entries = {"flow/rover__base__twist": {"component": "base"}}
    assert list(claims_of("mule", entries)) == []


@pytest.mark.parametrize(
    ("key", "body", "told"),
    [
        ("component/Bad Id", {}, "its id is no id of a component"),
        ("component/a", {}, "readiness or rank is missing"),
        ("component/a", {"ready": 1, "rank": 1}, "readiness or rank is missing"),
        ("component/a", {"ready": True, "rank": True}, "readiness or rank is missing"),
        ("component/a", {"ready": True, "rank": 1}, "the list of what is withheld is missing"),
        ("component/a", {"ready": True, "rank": 1, "withheld": "a"}, "the list of what is"),
        ("component/a", {"ready": True, "rank": 1, "withheld": [7]}, "the list of what is"),
        ("component/a", {"ready": True, "rank": 1, "withheld": []}, "DESCRIPTION_INVALID"),
        ("mount/rover__a__b", {"xyz": [0, 0, 0], "rpy": [0, 0, 0]}, "the unit is not its own"),
        ("mount/mule__a__b", {"xyz": [0, 0], "rpy": [0, 0, 0]}, "xyz is not three numbers"),
        ("device/usb1", {}, "component is missing"),
    ],
)
def test_entry_that_is_wrong_costs_itself_and_is_told(
    key: str, body: dict[str, Any], told: str
) -> None:
    sound = catalogue_entries(snapshot(component()), Policy())
    record = record_of(ME, {**sound, key: body})
    assert [offered.id for offered in record.components] == ["watcher@mule"]
    (problem,) = record.problems
    assert problem.code == "PEER_ENTRY"
    assert told in problem.message


def test_only_so_many_components_are_taken_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peer_entries, "MOST_COMPONENTS", 1)
    (key, body), *_ = catalogue_entries(snapshot(component()), Policy()).items()
    assert key == "component/watcher"
    record = record_of(ME, {key: body, "component/watcher-2": body})
    assert len(record.components) == 1
    assert [problem.code for problem in record.problems] == ["PEER_ENTRY"]


@pytest.mark.parametrize("value", [{"type": "nothing"}, 7, "text"])
def test_fact_with_a_value_that_is_no_message_says_nothing(value: object) -> None:
    said: dict[str, Any] = {"predicate": "sees", "arguments": ["mule__watcher__eye", "mule"]}
    assert len(list(claims_of("mule", {"fact/watcher/1": said}))) == 1
    assert list(claims_of("mule", {"fact/watcher/1": {**said, "value": value}})) == []


KEYS = st.builds(
    "{}/{}".format,
    st.sampled_from(["component", "mount", "device", "fact", "flow", "taken"]),
    st.text(),
)
BODIES = st.dictionaries(
    st.sampled_from(
        ["ready", "rank", "withheld", "description", "by", "component", "predicate", "arguments"]
    ),
    st.none() | st.booleans() | st.integers() | st.text() | st.lists(st.text()),
)


@given(st.dictionaries(KEYS, BODIES))
def test_nothing_that_a_peer_makes_up_breaks_this_host(entries: dict[str, Any]) -> None:
    record_of(ME, entries)
    for _, claim in claims_of("mule", entries):
        assert claim.component.endswith("@mule")
    assert taken_in("mule", entries, "rover").keys() <= {
        key.removeprefix("taken/") for key in entries if "mule__" in key
    }


ENTRIES = st.dictionaries(st.sampled_from("abcd"), st.builds(lambda n: {"n": n}, st.integers()))


@given(ENTRIES, ENTRIES)
def test_changes_lead_from_one_to_the_other(
    before: dict[str, dict[str, Any]], after: dict[str, dict[str, Any]]
) -> None:
    now: dict[str, Any] = dict(before)
    for key, body in changes(before, after).items():
        if body is None:
            del now[key]
        else:
            now[key] = body
    assert now == after


def test_behaviour_takes_what_its_action_deletes_of_what_can_be_taken() -> None:
    merged = merged_watcher()
    arguments = {"u": "mule__watcher__eye", "o": "mule__watcher__image", "h": "rover"}
    assert taken_by(merged, "watcher", "look", arguments) == {
        "free mule__watcher__image",
        "idle mule__watcher__eye",
    }
    assert taken_by(merged, "watcher", "turn", arguments) == frozenset()
    assert taken_by(merged, "watcher", "look", {"u": "x"}) == frozenset()
