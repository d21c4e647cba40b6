"""The world model: which component may say what, what lasts, and what leaves with a component."""

from __future__ import annotations

import pytest
from tests.kit.golden import Golden

from nondum.planning.execute.provenance import Source
from nondum.planning.execute.world import MOST_DENIALS, WorldModel
from nondum.planning.pddl.facts import twin


@pytest.fixture
def world() -> WorldModel:
    return WorldModel()


def stream(world: WorldModel) -> None:
    """A camera streams."""
    world.set_host_facts("rover", {"free img": "nothing uses it", "ready cam": "healthy"}, 0.0)
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


def test_effects_that_are_withdrawn_leave_what_components_say(world: WorldModel) -> None:
    world.succeed("go a b", "base", add=["at b", "tired"], delete=["at a"], at_s=1.0)
    world.know("tired", "nurse", 2.0)
    world.withdraw_effects(["at b", "tired", "unheard of"])
    assert not world.holds("at b")
    assert world.holds("tired")


def test_succeeded_behaviour_is_believed(world: WorldModel) -> None:
    world.know("at a", "map", 0.0)
    world.succeed("go a b", "base", add=["at b"], delete=["at a"], at_s=1.0)
    assert world.facts == {"at b"}


def test_observed_effects_wait_for_the_observer(world: WorldModel) -> None:
    world.frame(objects=frozenset({"a", "b"}), observed=frozenset({"at"}))
    world.know("at a", "scale", 0.0)
    world.succeed("go a b", "base", add=["at b", "tired"], delete=["at a"], at_s=1.0)
    assert world.facts == {"at a", "tired"}


def test_no_component_denies_what_the_host_knows(world: WorldModel) -> None:
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
    assert world.parked() == ("near cup",)
    assert world.evidence("near cup").absent == ("cup",)
    world.frame(objects=frozenset({"cup"}), observed=frozenset())
    assert world.parked() == ()
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
    world.establish("s", "c", add=["on", twin("off")], delete=["off", twin("on")], at_s=0.0)
    assert world.facts == {"on"}


def said(sources: tuple[Source, ...]) -> list[str]:
    return [source.said for source in sources]


def test_evidence_tells_both_sides(world: WorldModel, golden: Golden) -> None:
    stream(world)
    free = world.evidence("free img")
    assert not free.holds
    golden.check("a stream would be free", "\n".join(said(free.pros)))
    golden.check("a stream is used", "\n".join(said(free.cons)))
    assert free.cons[0].action == "stream cam"
    flowing = world.evidence("flowing img")
    assert (flowing.holds, flowing.since_s) == (True, 1.0)
    rain = world.evidence("rain")
    assert (rain.holds, rain.pros, rain.cons, rain.since_s) == (False, (), (), None)


def test_news_beat_what_a_running_behaviour_took(world: WorldModel) -> None:
    world.know("docked rover", "dock", 0.0)
    world.establish("drive", "base", add=[], delete=["docked rover"], at_s=1.0)
    assert not world.facts
    world.know("docked rover", "dock", 2.0)
    assert world.facts == {"docked rover"}


def test_dead_observer_lets_nothing_be_believed(world: WorldModel) -> None:
    world.succeed("open", "arm", add=["open door"], delete=[], at_s=0.0)
    world.forget("open door", "camera", 1.0)
    world.silence("camera")
    assert not world.facts


def test_denials_of_one_component_are_bounded(world: WorldModel) -> None:
    for number in range(MOST_DENIALS + 1):
        world.forget(f"seen thing-{number}", "chatterbox", float(number))
    assert not world.evidence("seen thing-0").cons
    assert world.evidence("seen thing-1").cons
    world.know("seen thing-1", "chatterbox", 1e6)
    world.forget("seen another", "chatterbox", 2e6)
    assert world.facts == {"seen thing-1"}


def test_denial_goes_with_who_denied(world: WorldModel) -> None:
    world.seed("map", ["at a"], 0.0)
    world.succeed("go a b", "base", add=["at b"], delete=["at a"], at_s=1.0)
    world.remove_component("base", ())
    assert world.facts == {"at a"}


# Functional predicates


@pytest.fixture
def placed(world: WorldModel) -> WorldModel:
    """A world in which a thing is at one place."""
    places = frozenset({"cup", "pot", "a", "b", "c"})
    world.frame(objects=places, observed=frozenset(), functional=frozenset({"at"}))
    return world


def test_observation_beats_a_default(placed: WorldModel) -> None:
    placed.know("at cup b", "camera", 0.0)
    placed.seed("map", ["at cup a", "at pot a"], 1.0)
    assert placed.facts == {"at cup b", "at pot a"}
    assert placed.evidence("at cup a").rival == "at cup b"
    placed.remove_component("camera", ())
    assert placed.facts == {"at cup a", "at pot a"}


def test_effect_withdraws_the_earlier_place(placed: WorldModel) -> None:
    placed.know("at cup a", "camera", 0.0)
    placed.succeed("carry cup b", "arm", add=["at cup b"], delete=[], at_s=1.0)
    assert placed.facts == {"at cup b"}


def test_effect_waits_where_conditions_observe(placed: WorldModel) -> None:
    places, at = frozenset({"cup", "a", "b"}), frozenset({"at"})
    placed.frame(objects=places, observed=at, functional=at)
    placed.know("at cup a", "camera", 0.0)
    placed.establish("hold cup b", "arm", add=["at cup b"], delete=[], at_s=1.0)
    assert placed.facts == {"at cup a"}


def test_running_behaviour_hides_a_place_until_it_ends(placed: WorldModel) -> None:
    placed.seed("map", ["at cup a"], 0.0)
    placed.establish("hold cup b", "arm", add=["at cup b"], delete=[], at_s=1.0)
    assert placed.facts == {"at cup b"}
    assert placed.bare_facts == {"at cup a"}
    placed.end("hold cup b")
    assert placed.facts == {"at cup a"}


def test_newest_of_two_observers_wins_and_both_are_named(
    placed: WorldModel, golden: Golden
) -> None:
    placed.know("at cup a", "left", 1.0)
    placed.know("at cup b", "right", 0.0)
    assert placed.facts == {"at cup a"}
    [problem] = placed.conflicts()
    assert problem.code == "PDDL_FACT_CONFLICT"
    golden.check("two observers contradict each other", problem.message)
    placed.forget("at cup a", "left", 2.0)
    assert placed.facts == {"at cup b"}
    assert not placed.conflicts()


def test_observer_that_moves_on_contradicts_no_one(placed: WorldModel) -> None:
    placed.know("at cup a", "camera", 0.0)
    placed.know("at cup b", "camera", 1.0)
    assert placed.facts == {"at cup b"}
    assert not placed.conflicts()
    placed.forget("at cup b", "camera", 2.0)
    assert not placed.facts


def test_word_that_turns_functional_later_is_sorted_out(world: WorldModel) -> None:
    world.know("at cup a", "camera", 0.0)
    world.know("at cup b", "camera", 1.0)
    objects = frozenset({"cup", "a", "b"})
    world.frame(objects=objects, observed=frozenset(), functional=frozenset({"at"}))
    assert world.facts == {"at cup b"}


def test_functional_predicate_of_one_argument_has_one(world: WorldModel) -> None:
    objects = frozenset({"slow", "fast"})
    world.frame(objects=objects, observed=frozenset(), functional=frozenset({"speed"}))
    world.know("speed slow", "base", 0.0)
    world.know("speed fast", "base", 1.0)
    assert world.facts == {"speed fast"}


def test_value_that_is_parked_outdoes_no_other(placed: WorldModel) -> None:
    placed.know("at cup a", "left", 0.0)
    placed.know("at cup attic", "right", 1.0)
    assert placed.facts == {"at cup a"}
    assert not placed.conflicts()
