"""A goal without a plan is traced to what is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from tests.kit.golden import Golden
from tests.planning.fragments import brings
from tests.planning.strangers import (
    LAMP,
    MOBILE_BASE,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    ROVER,
    SPEAKER,
    VISUAL_TRACKER,
    at_rest,
    component,
    components,
)

from nondum.planning.explain.cause import Lack
from nondum.planning.explain.explain import Diagnosis, explain, suppliers
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.search import solve
from nondum.sdk.planner import Answer, GaveUp, GroundTask

FOLLOW = "(following self person)"


def why(
    contributions: Iterable[Contribution],
    goal: str = FOLLOW,
    *,
    not_so: Iterable[str] = (),
    search: Callable[[GroundTask], Answer] | None = None,
) -> Diagnosis:
    present = list(contributions)
    merged = merge(present, ROVER)
    assert not merged.quarantined, merged.quarantined
    facts = at_rest(present, merged) - set(not_so)
    return explain(merged, facts, parse_goal(goal, merged).expr, search=search)


def planned(task: GroundTask) -> Answer:
    return solve(task, lambda: False)


def lamp(body: str, init: str = "") -> Contribution:
    """A light that knows these actions, about a hall and a cellar."""
    words = """(:constants hall cellar - place)
      (:predicates (lit ?p - place) (wired ?p - place) (dark ?p - place) (open ?p - place)
      (usable ?p - place) (near ?p - place))"""
    facts = f"(:init {init})" if init else ""
    return brings("lamp", f"{words} {body}", facts, units={"led": "light"})


def shining(precondition: str, more: str = "", init: str = "") -> Contribution:
    """A lamp that lights a place under this condition."""
    shine = f"""(:action shine :parameters (?u - light ?p - place)
      :precondition (and (ready ?u) {precondition}) :effect (lit ?p))"""
    return lamp(f"{shine} {more}", init)


def test_pulled_camera_is_named_by_what_it_gave(golden: Golden) -> None:
    diagnosis = why(components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE]))
    [cause] = diagnosis.causes
    assert (cause.lack, cause.types) == (Lack.OBJECT, ("image",))
    assert cause.path == ("mobile-base.drive", "visual-tracker.track", "people-detector.detect")
    golden.check("there is no object", str(diagnosis.problems()[0]))


def test_missing_action_is_named_by_its_effect() -> None:
    [cause] = why(components([PEOPLE_DETECTOR, RECORDED_CAMERA])).causes
    assert (cause.lack, cause.fact, cause.path) == (Lack.ACTION, "following rover person", ())


def test_camera_on_another_body_is_told() -> None:
    here = components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    [cause] = why([*here, component(RECORDED_CAMERA, host="mule")]).causes
    assert cause.lack is Lack.HOST
    assert cause.fact == "on mule__recorded-camera__camera rover"


def test_unit_that_is_not_ready_is_told(golden: Golden) -> None:
    present = components([RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    unit = "rover__mobile-base__wheels"
    [cause] = why(present, not_so=[f"ready {unit}"]).causes
    assert (cause.lack, cause.fact) == (Lack.HOST, f"ready {unit}")
    golden.check("a unit is not ready", str(cause.problem()))


def test_every_root_is_told() -> None:
    present = components([RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE])
    not_so = ["ready rover__mobile-base__wheels", "ready rover__recorded-camera__camera"]
    causes = why(present, not_so=not_so).causes
    assert sorted(cause.fact for cause in causes) == not_so


def test_contested_resource_is_told(golden: Golden) -> None:
    shared = component(PEOPLE_DETECTOR)
    both = [
        component(plugin, host)
        for host in ("rover", "mule")
        for plugin in (RECORDED_CAMERA, VISUAL_TRACKER, MOBILE_BASE)
    ]
    goal = "(and (following rover person) (following mule person))"
    diagnosis = why([shared, *both], goal)
    assert not diagnosis.causes
    assert diagnosis.conflict is not None
    assert "free rover__people-detector__found" in diagnosis.conflict.contested
    golden.check("an input is wanted twice", diagnosis.problems()[0].message)


def test_suppliers_are_those_that_bring_it() -> None:
    diagnosis = why(components([PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE]))
    known = components([SPEAKER, RECORDED_CAMERA, LAMP])
    assert [c.component for c in suppliers(diagnosis.causes, known)] == ["recorded-camera"]
    missing_base = why(components([PEOPLE_DETECTOR, RECORDED_CAMERA]))
    known = components([SPEAKER, MOBILE_BASE])
    assert [c.component for c in suppliers(missing_base.causes, known)] == ["mobile-base"]


def test_circle_of_needs_ends() -> None:
    """Detections may come from the detector's own output: tracing must not go round for ever."""
    present = components([SPEAKER, VISUAL_TRACKER, PEOPLE_DETECTOR])
    [cause] = why(present, "(reported person self)").causes
    assert cause.types == ("image",)


HEAD = brings(
    "head",
    """(:constants sun moon - target)
    (:action point :parameters (?u - pointer ?t - target ?h - host)
      :precondition (and (ready ?u) (on ?u ?h) (idle ?u))
      :effect (and (not (idle ?u)) (pointing ?h ?t)))""",
    units={"neck": "pointer"},
)
WIRE = """(:action wire :parameters (?u - light ?p - place)
  :precondition (open ?p) :effect (wired ?p))"""


def test_disjunction_needs_only_its_cheapest_part() -> None:
    """Wiring lacks one thing more to do than darkness; both lack one thing for good."""
    [cause] = why([shining("(or (wired ?p) (dark ?p))", WIRE)], "(lit hall)").causes
    assert (cause.lack, cause.fact, cause.path) == (Lack.ACTION, "dark hall", ("lamp.shine",))


def test_conjunction_in_a_disjunction_counts_all_it_lacks() -> None:
    lacking = shining("(or (and (dark ?p) (wired ?p)) (open ?p))")
    [cause] = why([lacking], "(lit hall)").causes
    assert cause.fact == "open hall"


def test_existence_of_nothing_is_told_as_a_missing_object() -> None:
    lacking = shining("(exists (?t - target ?h - host) (bearing-known ?t ?h))")
    [cause] = why([lacking], "(lit hall)").causes
    assert (cause.lack, cause.types) == (Lack.OBJECT, ("target",))


def test_existence_is_traced_for_any_object() -> None:
    lacking = shining("(exists (?q - place) (and (wired ?q) (dark ?q)))", init="(dark cellar)")
    [cause] = why([lacking], "(lit hall)").causes
    assert cause.fact == "wired cellar"


def test_universal_condition_names_the_object_that_fails() -> None:
    lacking = shining("(forall (?q - place) (wired ?q))", init="(wired hall)")
    [cause] = why([lacking], "(lit hall)").causes
    assert (cause.fact, cause.path) == ("wired cellar", ("lamp.shine",))


def test_derived_facts_are_traced_through_their_rules() -> None:
    rule = "(:derived (usable ?p - place) (and (wired ?p) (dark ?p)))"
    lacking = shining("(usable ?p)", f"{WIRE} {rule}", "(dark hall)")
    [cause] = why([lacking], "(lit hall)").causes
    assert (cause.fact, cause.path) == ("open hall", ("lamp.shine", "lamp.wire"))


def test_conditional_effects_are_traced_through_their_conditions() -> None:
    change = """(:action shine :parameters (?u - light)
      :precondition (ready ?u) :effect (forall (?p - place) (when (wired ?p) (lit ?p))))"""
    [cause] = why([lamp(change)], "(lit hall)").causes
    assert (cause.fact, cause.path) == ("wired hall", ("lamp.shine",))


def test_what_nothing_makes_false_is_told(golden: Golden) -> None:
    [cause] = why([shining("(not (wired ?p))", init="(wired hall)")], "(lit hall)").causes
    assert (cause.lack, cause.fact) == (Lack.FALSE, "wired hall")
    golden.check("nothing makes it false", str(cause.problem()))


def test_goal_that_is_to_be_false_is_told_too() -> None:
    present = [shining("(dark ?p)", init="(wired hall)")]
    [cause] = why(present, "(and (not (wired hall)))").causes
    assert (cause.lack, cause.fact, cause.path) == (Lack.FALSE, "wired hall", ())


def test_actions_that_wait_for_each_other_are_a_circle() -> None:
    open_ = """(:action open :parameters (?u - light ?p - place)
      :precondition (wired ?p) :effect (open ?p))"""
    [cause] = why([lamp(f"{WIRE} {open_}")], "(open hall)").causes
    assert (cause.lack, cause.fact) == (Lack.CIRCLE, "open hall")


def test_shortest_of_several_chains_is_told() -> None:
    long = """(:action open :parameters (?u - light ?p - place)
      :precondition (dark ?p) :effect (open ?p))"""
    short = """(:action clamp :parameters (?u - light ?p - place)
      :precondition (lit ?p) :effect (wired ?p))"""
    [cause] = why([lamp(f"{WIRE} {long} {short}")], "(wired hall)").causes
    assert (cause.fact, cause.path) == ("lit hall", ("lamp.clamp",))


def test_what_only_one_of_two_conditions_lacks_is_not_forgotten() -> None:
    """One condition goes in a circle, so this action cannot be the way."""
    ring = """(:action open :parameters (?u - light ?p - place)
      :precondition (and (wired ?p) (dark ?p)) :effect (open ?p))"""
    other = """(:action pry :parameters (?u - light ?p - place)
      :precondition (and (lit ?p) (near ?p)) :effect (open ?p))"""
    causes = why([lamp(f"{WIRE} {ring} {other}")], "(wired hall)").causes
    assert {cause.fact for cause in causes} == {"lit hall", "near hall"}


def test_function_without_a_value_is_named() -> None:
    """Such an action cannot be taken, though all its conditions can be met."""
    body = """(:functions (effort ?p - place))
     (:action shine :parameters (?u - light ?p - place) :precondition (ready ?u)
      :effect (and (lit ?p) (increase (total-cost) (effort ?p))))"""
    light = lamp(body, "(= (effort cellar) 2)")
    [cause] = why([light], "(lit hall)").causes
    assert (cause.lack, cause.fact, cause.path) == (Lack.VALUE, "effort hall", ("lamp.shine",))
    assert "(effort hall) has no value, which lamp.shine needs" in str(cause.problem())


def test_streams_of_another_type_are_no_way() -> None:
    """Detections would make (flowing …) true, but it is an image that is needed."""
    known = components([VISUAL_TRACKER, PEOPLE_DETECTOR])
    diagnosis = why(known, "(exists (?i - image) (flowing ?i))")
    assert [cause.types for cause in diagnosis.causes] == [("image",)]


def test_parts_that_exclude_each_other_are_named(golden: Golden) -> None:
    goal = "(and (pointing self sun) (pointing self moon))"
    [problem] = why([HEAD], goal, search=planned).problems()
    golden.check("two parts of the goal exclude each other", str(problem))


def test_of_three_parts_only_the_pair_that_excludes_each_other_is_named() -> None:
    light = shining("(dark ?p)", init="(dark hall)")
    goal = "(and (lit hall) (pointing self sun) (pointing self moon))"
    conflict = why([HEAD, light], goal, search=planned).conflict
    assert conflict is not None
    assert conflict.pairs == (("(pointing rover sun)", "(pointing rover moon)"),)


def test_part_that_cannot_be_had_alone_is_named() -> None:
    """What it takes to open the hall is used up by wiring it."""
    body = """(:action open :parameters (?u - light ?p - place)
      :precondition (wired ?p) :effect (and (open ?p) (not (wired ?p))))
     (:action shine :parameters (?u - light ?p - place)
      :precondition (and (wired ?p) (open ?p)) :effect (lit ?p))"""
    light = lamp(body, "(wired hall) (dark hall)")
    conflict = why([light], "(and (dark hall) (lit hall))", search=planned).conflict
    assert conflict is not None
    assert conflict.alone == ("(lit hall)",)


def test_what_was_not_found_out_is_not_called_impossible(golden: Golden) -> None:
    goal = "(and (lit hall) (lit cellar) (open hall))"
    light = lamp(
        """(:action shine :parameters (?u - light ?p - place)
          :precondition (dark ?p) :effect (and (lit ?p) (forall (?q - place) (not (dark ?q)))))""",
        "(dark hall) (dark cellar) (open hall)",
    )
    conflict = why([light], goal, search=lambda _: GaveUp("no time")).conflict
    assert conflict is not None
    assert conflict.undecided
    assert not conflict.pairs
    golden.check("there was no time to find out", str(conflict.problems()[0]))
