"""What would help: the smallest sets of payloads, each with the plan that it would give."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import combinations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from tests.planning.fragments import HOST, brings
from tests.planning.strangers import (
    LAMP,
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    SPEAKER,
    STRANGERS,
    THERMAL_CAMERA,
    VISUAL_TRACKER,
    camera,
    component,
    components,
)

from nondum.planning.explain.advise import Advice, Candidate, Here, Way, advise
from nondum.planning.explain.advise.trial import Outcome, Trials
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.planning.search import solve
from nondum.planning.search.validate import validate
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import GoalRefused
from nondum.sdk.planner import Answer, GaveUp, GroundTask

FOLLOW = "(following self person)"
POINT = "(pointing self radiation-source)"


def search(task: GroundTask) -> Answer:
    return solve(task, lambda: False)


def payload(id: str, *contributions: Contribution, version: str = "1.0") -> Candidate:
    facts = frozenset(fact for c in contributions for fact in c.body_facts())
    return Candidate(id, version, "a shelf", contributions, facts)


def of_plugin(plugin: PluginDescription) -> Candidate:
    return payload(plugin.name, component(plugin))


def here(contributions: Iterable[Contribution] = ()) -> Here:
    present = tuple(contributions)
    facts = {f"self {HOST}", *merge(present, HOST).init}
    return Here(HOST, present, frozenset(facts.union(*(c.body_facts() for c in present))))


def sets(advice: Advice) -> set[frozenset[str]]:
    return {frozenset(candidate.id for candidate in way.payloads) for way in advice.ways}


SHELF = [of_plugin(plugin) for plugin in STRANGERS]


def shelf(present: Here) -> list[Candidate]:
    """All payloads but those that are here."""
    components_here = {contribution.component for contribution in present.contributions}
    return [candidate for candidate in SHELF if candidate.id not in components_here]


def ask(present: Here, goal: str, candidates: Iterable[Candidate] | None = None) -> Advice:
    offered = shelf(present) if candidates is None else candidates
    return advise(present, goal, offered, search)


def followers(*, camera: bool = False) -> Here:
    plugins = [PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE]
    return here(components([*plugins, *([RECORDED_CAMERA] if camera else [])]))


def test_each_camera_brings_following_back() -> None:
    advice = ask(followers(), FOLLOW)
    cameras = {"recorded-camera", "thermal-camera", "stereo-camera"}
    assert sets(advice) == {frozenset({camera}) for camera in cameras}
    assert advice.is_complete
    steps = [step.split(" ")[0] for step in advice.ways[0].steps]
    assert steps[0].endswith("camera.stream")
    assert steps[1:] == ["people-detector.detect", "visual-tracker.track", "mobile-base.drive"]


def test_payloads_that_need_each_other_are_found_together() -> None:
    assert sets(ask(here(), POINT)) == {frozenset({"compton-camera", "pan-tilt-unit"})}


def test_whole_robot_is_put_together_from_a_shelf() -> None:
    others = {"people-detector", "visual-tracker", "mobile-base"}
    cameras = {"recorded-camera", "thermal-camera", "stereo-camera"}
    assert sets(ask(here(), FOLLOW)) == {frozenset({camera, *others}) for camera in cameras}


def test_only_what_the_goal_depends_on_is_looked_at() -> None:
    assert ask(here(), POINT).looked_at == 2


def test_what_is_possible_needs_no_payload() -> None:
    advice = ask(followers(camera=True), FOLLOW)
    assert advice.now is not None
    assert not advice.ways
    assert len(advice.now.steps) == 4


def test_nothing_that_is_known_may_help() -> None:
    advice = ask(followers(), FOLLOW, [of_plugin(LAMP), of_plugin(SPEAKER)])
    assert not advice.helps
    assert advice.is_complete


def test_goals_words_may_come_with_the_payload() -> None:
    (lamp,) = ask(here(), "(exists (?u - light) (lit ?u))").ways
    assert [candidate.id for candidate in lamp.payloads] == ["lamp"]


def test_second_unit_of_a_kind_helps_where_one_is_not_enough() -> None:
    """Nothing is missing for either part, but the one head cannot look two ways."""
    both = "(and (pointing self sun) (pointing self moon))"
    body = """(:constants sun moon - target)
      (:action look :parameters (?u - pointer ?t - target ?h - host)
        :precondition (and (ready ?u) (on ?u ?h) (idle ?u))
        :effect (and (not (idle ?u)) (pointing ?h ?t)))"""
    first = brings("head", body, units={"neck": "pointer"})
    second = brings("head", body, units={"neck": "pointer"}, component="other-head")
    advice = ask(here([first]), both, [payload("second", second), of_plugin(PAN_TILT_UNIT)])
    assert frozenset({"second"}) in sets(advice)


def test_facts_and_objects_alone_may_help() -> None:
    light = brings(
        "lamp",
        """(:predicates (lit ?p - place) (wired ?p - place))
        (:action shine :parameters (?u - light ?p - place)
          :precondition (and (ready ?u) (wired ?p)) :effect (lit ?p))""",
        units={"led": "light"},
    )
    words = "(:predicates (wired ?p - place)) (:constants hall - place)"
    map_ = payload("map", brings("map", words, "(:init (wired hall))"))
    bare = payload("bare", brings("bare", "(:constants hall - place)"))
    assert sets(ask(here([light]), "(lit hall)", [map_, bare])) == {frozenset({"map"})}


def test_of_payloads_that_contradict_each_other_no_set_has_both() -> None:
    """Each says something else of what a reading is, and a third needs either."""
    reading = "(:action read :parameters (?u - sensor ?h - host) :effect {effect})"
    one = brings(
        "one",
        f"(:predicates (measured ?h - host)) {reading.format(effect='(measured ?h)')}",
        units={"probe": "sensor"},
    )
    two = brings(
        "two",
        f"(:predicates (measured ?u - sensor)) {reading.format(effect='(measured ?u)')}",
        units={"probe": "sensor"},
    )
    tell = brings(
        "tell",
        """(:predicates (measured ?h - host))
        (:action tell :parameters (?u - speaker ?h - host ?c - class)
          :precondition (measured ?h) :effect (found ?c ?h))""",
        units={"voice": "speaker"},
    )
    person = brings("person", "(:constants person - class)")
    shelf = [payload(c.component, c) for c in (one, two, tell, person)]
    advice = ask(here(), "(found person self)", shelf)
    assert sets(advice) == {frozenset({"one", "tell", "person"})}


def test_two_releases_of_one_payload_are_alternatives() -> None:
    old, new = component(RECORDED_CAMERA), component(THERMAL_CAMERA)
    same = replace(new, component=old.component)
    offered = [payload("camera", old), payload("camera", same, version="2.0")]
    ways = ask(followers(), FOLLOW, offered).ways
    assert [way.payloads[0].name for way in ways] == ["camera 1.0", "camera 2.0"]


def test_payload_that_contradicts_what_is_here_is_unfit_and_says_why() -> None:
    shine = "(:action shine :parameters (?u - light {more}) :effect (lit {what}))"
    words = brings("words", "(:predicates (lit ?h - host))")
    odd = "(:predicates (lit ?p - place)) " + shine.format(more="?p - place", what="?p")
    good = "(:predicates (lit ?h - host)) " + shine.format(more="?h - host", what="?h")
    offered = [
        payload("odd", brings("odd", odd, units={"led": "light"})),
        payload("good", brings("good", good, units={"led": "light"})),
    ]
    advice = ask(here([words]), "(lit self)", offered)
    assert sets(advice) == {frozenset({"good"})}
    [unfit] = advice.unfit
    assert unfit.id == "odd"
    assert unfit.caveats[0].code in ("PDDL_ARITY", "PDDL_SIGNATURE")


def test_rest_of_a_payload_helps_though_a_part_of_it_is_kept_out() -> None:
    odd = brings("odd", "(:predicates (following ?c - class))")
    [way] = ask(followers(), FOLLOW, [payload("pack", odd, component(RECORDED_CAMERA))]).ways
    [used] = way.payloads
    assert [c.component for c in used.contributions] == ["recorded-camera"]
    assert used.caveats[0].code in ("PDDL_ARITY", "PDDL_SIGNATURE")


def test_payload_of_which_all_is_here_in_another_release_is_not_told_of() -> None:
    advice = ask(followers(), FOLLOW, [of_plugin(MOBILE_BASE)])
    assert not advice.ways
    assert not advice.unfit


def test_payload_that_is_in_the_way_is_left_out() -> None:
    """A shutter is found with the lamp on the shelf; nothing may be dark for the lamp to shine."""
    light = brings(
        "lamp",
        """(:predicates (lit ?h - host) (dark ?h - host))
        (:action shine :parameters (?u - light ?h - host)
          :precondition (and (ready ?u) (not (dark ?h))) :effect (lit ?h))""",
        units={"led": "light"},
    )
    shutter = brings("shutter", "(:predicates (dark ?h - host))", "(:init (dark self))")
    offered = [payload("lamp", light), payload("shutter", shutter)]
    advice = ask(here(), "(lit self)", offered)
    assert sets(advice) == {frozenset({"lamp"})}
    assert advice.is_complete


def test_what_was_not_found_out_is_not_called_impossible() -> None:
    advice = advise(followers(), FOLLOW, SHELF[:1], lambda _: GaveUp("no time"))
    assert not advice.ways
    assert not advice.is_complete


def test_limits_are_told() -> None:
    advice = advise(followers(), FOLLOW, SHELF_OF_CAMERAS, search, ways_limit=3)
    assert len(advice.ways) == 3
    assert not advice.is_complete
    few = advise(followers(), FOLLOW, SHELF_OF_CAMERAS, search, trials_limit=4)
    assert 0 < len(few.ways) < len(SHELF_OF_CAMERAS)
    assert not few.is_complete


SHELF_OF_CAMERAS = [
    of_plugin(RECORDED_CAMERA),
    of_plugin(THERMAL_CAMERA),
    *(payload(name, component(camera(name))) for name in ("stereo", "wide", "night", "fish-eye")),
]


def test_no_condition_is_refused() -> None:
    with pytest.raises(GoalRefused):
        ask(here(), "(following self")


def test_explosive_payload_helps_in_no_set() -> None:
    knobs = " ".join(f"k{number}" for number in range(60))
    wide = brings(
        "wide",
        f"""(:types knob - object) (:constants {knobs} - knob)
        (:action turn :parameters (?u - speaker ?a ?b ?c - knob ?h - host ?k - class)
          :precondition (ready ?u) :effect (following ?h ?k))""",
        units={"panel": "speaker"},
    )
    advice = ask(followers(), FOLLOW, [payload("wide", wide), of_plugin(RECORDED_CAMERA)])
    assert sets(advice) == {frozenset({"recorded-camera"})}
    assert advice.is_complete
    [unfit] = advice.unfit
    assert [problem.code for problem in unfit.caveats] == ["PDDL_TOO_MANY"]


# Random shelves, compared with trying all sets

WORDS = "abc"
DECLARED = "(:types knob - object) (:predicates (a ?h - host) (b ?h - host) (c ?h - host))"
OTHERWISE = "(:types knob - object) (:predicates (a ?h - host) (b ?k - knob) (c ?h - host))"
CONDITIONS = st.sampled_from(
    [
        "(ready ?u)",
        *(f"({word} ?h)" for word in WORDS),
        *(f"(not ({word} ?h))" for word in WORDS),
        "(or (a ?h) (c ?h))",
        "(exists (?k - knob) (c ?h))",
        "(forall (?k - knob) (c ?h))",
        "(idle ?u)",
    ]
)
EFFECTS = st.sampled_from(
    [
        *(f"({word} ?h)" for word in WORDS),
        *(f"(not ({word} ?h))" for word in WORDS),
        "(when (a ?h) (not (b ?h)))",
        "(when (c ?h) (b ?h))",
        "(forall (?k - knob) (when (not (a ?h)) (not (c ?h))))",
        "(not (idle ?u))",
    ]
)


@st.composite
def contributions(draw: st.DrawFn, name: str) -> Contribution:
    declared = OTHERWISE if draw(st.integers(0, 7)) == 0 else DECLARED
    body = declared
    if draw(st.booleans()):
        body += f" (:constants k{name} - knob)"
    if declared is DECLARED:
        for number in range(draw(st.integers(0, 2))):
            before = " ".join(draw(st.lists(CONDITIONS, max_size=2, unique=True)))
            after = " ".join(draw(st.lists(EFFECTS, min_size=1, max_size=2, unique=True)))
            body += f""" (:action do{number} :parameters (?u - speaker ?h - host)
                :precondition (and (on ?u ?h) {before}) :effect (and {after}))"""
    said = draw(st.lists(st.sampled_from(["(a self)", "(c self)"]), max_size=1))
    init = f"(:init {' '.join(said)})" if said else ""
    component_ = draw(st.sampled_from([name, name, name, "same"]))
    return brings(name, body, init, component=component_, units={"horn": "speaker"})


@st.composite
def shelves(draw: st.DrawFn) -> tuple[Here, list[Candidate]]:
    names = [f"p{number}" for number in range(draw(st.integers(0, 5)))]
    offered = []
    for name in names:
        own = [draw(contributions(name))]
        if draw(st.integers(0, 3)) == 0:
            own.append(draw(contributions(f"{name}x")))
        if len({c.component for c in own}) == len(own):
            offered.append(payload(name, *own))
    present = [draw(contributions("base"))] if draw(st.booleans()) else []
    return here(present), offered


def by_trying_all(
    present: Here, goal: str, candidates: list[Candidate]
) -> tuple[set[frozenset[str]], bool]:
    """The smallest sets with a plan, found by planning for every set, and whether these are
    certainly all: of a plan that one lasting behaviour cuts short, nothing follows."""
    trials = Trials(present, goal, candidates, search)
    every = range(len(candidates))
    outcomes = {
        frozenset(chosen): trials.of(frozenset(chosen)).outcome
        for size in range(len(candidates) + 1)
        for chosen in combinations(every, size)
    }
    possible = [chosen for chosen, outcome in outcomes.items() if outcome is Outcome.POSSIBLE]
    least = [one for one in possible if not any(other < one for other in possible)]
    ids = {frozenset(candidates[number].id for number in chosen) for chosen in least}
    return ids, Outcome.UNKNOWN not in outcomes.values()


@given(
    shelves(),
    st.sampled_from(["(b self)", "(and (a self) (b self))", "(and (b self) (not (a self)))"]),
)
def test_smallest_sets_are_those_that_trying_all_finds(
    world: tuple[Here, list[Candidate]], goal: str
) -> None:
    present, candidates = world
    advice = advise(present, goal, candidates, search, ways_limit=50, trials_limit=5000)
    expected, is_certain = by_trying_all(present, goal, sound(present, goal, candidates))
    assert advice.is_complete or not is_certain
    assume(is_certain)
    assert (set() if advice.now else sets(advice)) == expected - {frozenset()}
    assert (advice.now is not None) == (frozenset() in expected)
    for way in (*advice.ways, *([advice.now] if advice.now else [])):
        assert isinstance(way, Way)
        assert not validate(way.task, way.plan)


def sound(present: Here, goal: str, candidates: list[Candidate]) -> list[Candidate]:
    """The candidates without what would be kept out even if nothing else were brought."""
    trials = Trials(present, goal, candidates, search)
    return [trials.sound(number) for number in range(len(candidates))]
