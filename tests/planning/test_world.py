"""The world model: who may say what, what lasts, and what goes away with whom."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.planning.world import WorldModel


@pytest.fixture
def world() -> WorldModel:
    return WorldModel()


def stream(world: WorldModel) -> None:
    """A camera streams."""
    world.set_host_facts("rover", {"free img": "nobody uses it", "ready cam": "healthy"}, 0.0)
    world.establish("stream cam", "camera", add=["flowing img"], delete=["free img"], at_s=1.0)


def test_lasting_effects_hold_only_while_it_runs(world: WorldModel) -> None:
    stream(world)
    assert world.facts == {"flowing img", "ready cam"}
    world.end("stream cam")
    assert world.facts == {"free img", "ready cam"}


def test_facts_without_looks_ahead(world: WorldModel) -> None:
    stream(world)
    assert world.facts_without(["stream cam"]) == {"free img", "ready cam"} == world.bare_facts
    assert world.facts == {"flowing img", "ready cam"}


def test_fact_with_another_source_outlives_the_behaviour(world: WorldModel) -> None:
    stream(world)
    world.know("flowing img", "meter", 2.0)
    world.end("stream cam")
    assert world.holds("flowing img")


def test_observation_beats_lasting_effect(world: WorldModel) -> None:
    stream(world)
    world.forget("flowing img", "camera", 2.0)
    assert not world.holds("flowing img")
    world.establish("stream cam", "camera", add=["flowing img"], delete=["free img"], at_s=3.0)
    assert world.holds("flowing img")


def test_stall_that_is_over_is_taken_back(world: WorldModel) -> None:
    stream(world)
    world.forget("flowing img", "camera", 2.0)
    world.recant("flowing img", "camera")
    assert world.holds("flowing img")
    world.end("stream cam")
    assert not world.holds("flowing img")


def test_silent_component_observes_and_runs_nothing(world: WorldModel) -> None:
    stream(world)
    world.know("seen person", "camera", 0.0)
    world.succeed("scan", "camera", add=["scanned room"], delete=[], at_s=0.0)
    world.silence("camera")
    assert world.facts == {"free img", "ready cam", "scanned room"}


def test_succeeded_behaviour_is_believed(world: WorldModel) -> None:
    world.know("at a", "map", 0.0)
    world.succeed("go a b", "base", add=["at b"], delete=["at a"], at_s=1.0)
    assert world.facts == {"at b"}


def test_observed_effects_wait_for_the_observer(world: WorldModel) -> None:
    world.frame(objects=frozenset({"a", "b"}), observed=frozenset({"at"}))
    world.know("at a", "scale", 0.0)
    world.succeed("go a b", "base", add=["at b", "tired"], delete=["at a"], at_s=1.0)
    assert world.facts == {"at a", "tired"}


def test_nobody_denies_what_the_host_knows(world: WorldModel) -> None:
    stream(world)
    world.forget("ready cam", "stranger", 2.0)
    assert world.holds("ready cam")
    world.set_host_facts("rover", {}, 3.0)
    assert not world.holds("ready cam")


def test_one_observer_does_not_silence_another(world: WorldModel) -> None:
    world.know("seen person", "left", 0.0)
    world.know("seen person", "right", 0.0)
    world.forget("seen person", "left", 1.0)
    assert world.holds("seen person")
    world.forget("seen person", "right", 1.0)
    assert not world.holds("seen person")


def test_fragment_facts_are_applied_once(world: WorldModel) -> None:
    world.seed("map", ["at a", "door b"], 0.0)
    world.succeed("go a b", "base", add=["at b"], delete=["at a"], at_s=1.0)
    world.seed("map", ["at a", "door b"], 2.0)
    assert world.facts == {"at b", "door b"}


def test_component_takes_all_of_its_own_along(world: WorldModel) -> None:
    world.know("seen person", "camera", 0.0)
    world.know("beside cam wall", "map", 0.0)
    world.know("at a", "map", 0.0)
    stream(world)
    world.forget("at a", "camera", 1.0)
    world.remove_component("camera", {"cam", "img"})
    world.set_host_facts("rover", {}, 2.0)
    assert world.facts == {"at a"}


def test_facts_about_absent_objects_are_parked(world: WorldModel) -> None:
    world.know("near cup", "map", 0.0)
    world.frame(objects=frozenset(), observed=frozenset())
    assert not world.facts
    assert "parked: there is no object cup now" in world.why("near cup")
    world.frame(objects=frozenset({"cup"}), observed=frozenset())
    assert world.facts == {"near cup"}


def test_value_is_the_newest_and_dies_with_its_fact(world: WorldModel) -> None:
    world.know("bearing src", "old", 0.0, value=1)
    world.know("bearing src", "new", 1.0, value=2)
    assert world.value("bearing src") == 2
    world.forget("bearing src", "new", 2.0)
    assert world.value("bearing src") == 1
    world.forget("bearing src", "old", 3.0)
    assert world.value("bearing src") is None


def test_same_news_again_changes_nothing(world: WorldModel) -> None:
    world.know("bearing src", "rad", 0.0, value=1)
    before = world.facts
    world.know("bearing src", "rad", 1.0, value=2)
    assert world.facts is before


def test_twins_are_nobodys_claim(world: WorldModel) -> None:
    world.establish("s", "c", add=["on", "not-off"], delete=["off", "not-on"], at_s=0.0)
    assert world.facts == {"on"}


def test_why_tells_both_sides(world: WorldModel) -> None:
    stream(world)
    assert world.why("free img") == (
        "(free img) does not hold",
        "for it: nobody uses it",
        "against it: stream cam is established",
    )
    assert world.why("flowing img")[1] == "for it: stream cam is established"
    assert world.why("rain") == ("(rain) does not hold", "nobody has said so")


names = st.sampled_from(["a", "b", "c"])
told = st.one_of(
    st.tuples(st.just("know"), names, names),
    st.tuples(st.just("forget"), names, names),
    st.tuples(st.just("establish"), names, names),
    st.tuples(st.just("end"), names, names),
    st.tuples(st.just("succeed"), names, names),
)


@given(st.lists(told, max_size=12), st.lists(told, max_size=12))
def test_removal_leaves_no_trace_of_a_component(
    before: list[tuple[str, str, str]], after: list[tuple[str, str, str]]
) -> None:
    world = WorldModel()
    for news in before:
        tell(world, *news, component="guest")
    world.remove_component("guest", ())
    assert not world.facts
    fresh = WorldModel()
    for news in after:
        tell(world, *news, component="other")
        tell(fresh, *news, component="other")
    assert world.facts == fresh.facts


def tell(world: WorldModel, what: str, one: str, other: str, *, component: str) -> None:
    match what:
        case "know":
            world.know(one, component, 0.0)
        case "forget":
            world.forget(one, component, 0.0)
        case "establish":
            world.establish(f"s {one}", component, add=[one], delete=[other], at_s=0.0)
        case "end":
            world.end(f"s {one}")
        case "succeed":
            world.succeed(f"f {one}", component, add=[one], delete=[other], at_s=0.0)
