"""What a host calls components and plugins of which two payloads have one name."""

from __future__ import annotations

import re
from itertools import islice

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.sandbox.cgroups.limits import NAME as CGROUP
from nondum.host.sandbox.helper.requests import COMPONENT
from nondum.planning.merge.given_names import (
    LONGEST,
    GivenNames,
    forms,
    of_components,
    of_plugin,
    plugins_of_other_payloads,
)
from nondum.planning.pddl.parse import parse_formula
from nondum.sdk.description import Fragment
from nondum.wheelhouse.format.names import COMPONENT_ID

IDS = st.sampled_from(["gps", "gps-", "g-p", "clock", "g" * 63, "g" * 62 + "-", "0"])
PAYLOADS = st.sampled_from(
    ["a.b-c", "a-b.c", "a.b.c", "a-.b", "a--b.c", "x." + "y" * 126, "x." + "y" * 125 + "z", "0.0"]
)
BROUGHT = st.lists(st.tuples(PAYLOADS, st.lists(IDS, max_size=4, unique=True)), max_size=8)
A = ((Fragment("a.pddl", "a"),), ())
B = ((Fragment("b.pddl", "b"),), ())


@given(BROUGHT)
def test_no_two_components_have_one_name_and_each_keeps_its_own(
    brought: list[tuple[str, list[str]]],
) -> None:
    host: dict[str, dict[str, str]] = {}
    told: dict[tuple[str, str], str] = {}
    for payload, ids in brought:
        taken = {
            name for other, names in host.items() if other != payload for name in names.values()
        }
        named = of_components(payload, ids, host.get(payload, {}), taken)
        assert list(named) == ids
        assert named == of_components(payload, ids, named, taken)
        host[payload] = {**host.get(payload, {}), **named}
        for id, name in named.items():
            assert told.setdefault((payload, id), name) == name
    assert len(set(told.values())) == len(told)


@given(BROUGHT)
def test_a_name_is_named_as_itself(brought: list[tuple[str, list[str]]]) -> None:
    """What is remembered of a payload has names of this host already."""
    for payload, ids in brought:
        kept = of_components(payload, ids, {}, ids)
        again = of_components(payload, kept.values(), kept, ids)
        assert again == {name: name for name in kept.values()}


@given(IDS, PAYLOADS)
def test_every_form_is_a_name_wherever_components_are_named(id: str, payload: str) -> None:
    for name in islice(forms(id, payload), 20):
        assert len(name) <= LONGEST
        assert COMPONENT.fullmatch(name)
        assert CGROUP.fullmatch(f"{name}.1")
        assert "_" not in name  # objects are `host__component__unit`
        assert parse_formula(f"(ready rover__{name}__unit)", "goal")


@given(IDS, PAYLOADS)
def test_a_given_name_is_no_id_of_a_manifest(id: str, payload: str) -> None:
    for name in islice(forms(id, payload), 1, 20):
        assert not COMPONENT_ID.fullmatch(name)
        assert not re.fullmatch("[a-z0-9]+(-[a-z0-9]+)*", name), "nor a distribution"


def test_the_id_of_the_payload_can_be_read_in_a_name() -> None:
    named = of_components("org.example.north", ["gps"], {}, {"gps"})
    assert named == {"gps": "gps--org-example-north"}


def test_payloads_with_ids_that_differ_in_a_dot_only_have_two_names() -> None:
    first = of_components("org.a.b", ["gps"], {}, {"gps"})["gps"]
    second = of_components("org.a-b", ["gps"], {}, {"gps", first})["gps"]
    assert second.startswith(f"{first}--")


def test_a_name_that_would_be_too_long_is_cut_and_told_apart() -> None:
    long = "org.example." + "y" * 60
    [one] = of_components(long + "1", ["gps"], {}, {"gps"}).values()
    [two] = of_components(long + "2", ["gps"], {}, {"gps"}).values()
    assert len(one) == len(two) == LONGEST
    assert one != two


@pytest.mark.parametrize(
    ("words", "others", "name"),
    [
        ([A], {}, "gps"),
        ([A], {"gps": [A]}, "gps"),
        ([A], {"gps": [B]}, "gps--org-b"),
        ([A], {"gps": [A, B]}, "gps--org-b"),
        ([A, B], {}, "gps"),
        ([A, B], {"gps": [A]}, "gps--org-b"),
        ([A], {"clock": [B]}, "gps"),
    ],
    ids=["first", "same", "other", "of two", "its own", "more", "another name"],
)
def test_plugins_share_a_name_that_means_the_same(
    words: list[object], others: dict[str, list[object]], name: str
) -> None:
    assert of_plugin("gps", "org.b", words, None, others) == name  # type: ignore[arg-type]  # words are of either kind


def test_a_plugin_keeps_the_name_that_it_had() -> None:
    assert of_plugin("gps", "org.b", [A], "gps--org-b", {}) == "gps--org-b"


def test_a_name_that_was_given_stays_its_payload_s_while_that_is_away() -> None:
    """Two payload ids may make one name."""
    away = {"org.a-b": GivenNames(plugins={"gps": "gps--org-a-b", "clock": "clock"})}
    given = plugins_of_other_payloads(away, "org.a.b")
    name = of_plugin("gps", "org.a.b", [A], None, {"gps": [B]}, given)
    assert name not in ("gps", "gps--org-a-b")
    assert of_plugin("clock", "org.a.b", [A], None, {}, given) == "clock"
    assert of_plugin("gps", "org.a-b", [A], "gps--org-a-b", {"gps": [B]}, given) == "gps--org-a-b"
    assert plugins_of_other_payloads(away, "org.a-b") == frozenset()


def test_a_plugin_gives_up_a_name_that_means_something_else_meanwhile() -> None:
    assert of_plugin("gps", "org.b", [A], "gps", {"gps": [B]}) == "gps--org-b"
