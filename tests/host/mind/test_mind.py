"""A host's mind: goals pursued through recompositions, failures and losses."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from functools import partial

import pytest
from tests.host.mind.conftest import at_work
from tests.host.mind.robot import HOST, Robot
from tests.kit.clock import VirtualClock
from tests.kit.golden import Golden
from tests.planning.strangers import (
    BEACON,
    COMPTON_CAMERA,
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    SPEAKER,
    THERMAL_CAMERA,
    VISUAL_TRACKER,
)

from nondum.host.core.events.facts import FactKnown
from nondum.host.core.events.goals import GoalReached, PlanMade, PlanMissing
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.mount import MountPose
from nondum.host.mind.mind import PAUSE_S
from nondum.host.mind.planners import Planners
from nondum.planning.execute.attempts import Patience
from nondum.planning.execute.running import RunState
from nondum.planning.pddl.facts import twin
from nondum.sdk.description import Fragment, Output, Unit
from nondum.sdk.errors import GoalRefused

pytestmark = pytest.mark.anyio

FOLLOW = "(following self person)"
POINT = "(pointing self radiation-source)"
MOUNT = MountPose(f"{HOST}__recorded-camera__camera", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "person")
REPORT = "(reported person self)"
LIT_BEACON = f"(lit {HOST}__beacon__led)"
CHAIN = {"people-detector.detect", "visual-tracker.track", "mobile-base.drive"}


def plug_followers(robot: Robot) -> None:
    robot.plug(RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, MOBILE_BASE)


async def follow(robot: Robot) -> None:
    plug_followers(robot)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding()


def supplier(missing: PlanMissing) -> str:
    """Who used to give what is missing."""
    codes = [problem.code for problem in missing.problems]
    assert codes == ["WHY_NO_OBJECT", "WHY_SUPPLIER"]
    component, _, _ = missing.problems[1].message.partition(" ")
    assert missing.problems[1].fix.split()[-2:] == [f"org.example.{component}", "1.0"]
    return component


def has_tried(robot: Robot, times: int) -> bool:
    return robot.started.count("recorded-camera.stream") == times


async def test_goal_is_maintained(robot: Robot) -> None:
    await follow(robot)
    assert robot.running == {"recorded-camera.stream", *CHAIN}


async def test_goal_that_holds_on_is_told_once(robot: Robot, golden: Golden) -> None:
    await follow(robot)
    held = robot.told[-1]
    golden.check("a goal is kept", held, goal=FOLLOW)
    robot.plug(THERMAL_CAMERA)
    for _ in range(3):
        robot.mind.tick()
    assert robot.told.count(held) == 1


async def test_wiring_is_the_plans(robot: Robot) -> None:
    await follow(robot)
    frames, found = f"{HOST}__recorded-camera__frames", f"{HOST}__people-detector__found"
    assert dict(robot.call("detect").arguments) == {
        "u": f"{HOST}__people-detector__hog",
        "i": frames,
        "o": found,
        "h": HOST,
        "c": "person",
    }
    rows = {row["stream"]: row["consumers"] for row in robot.mind.views.streams()}
    assert rows[frames] == ["people-detector"]
    assert rows[found] == ["visual-tracker"]


async def test_achieved_goal_halts_everything(robot: Robot) -> None:
    robot.plug(RECORDED_CAMERA, PEOPLE_DETECTOR, VISUAL_TRACKER, SPEAKER)
    robot.mind.give(pddl=REPORT)
    await robot.until_goal("reached")
    await robot.until(lambda: not robot.running)
    assert robot.started[-2:] == ["visual-tracker.watch", "speaker.report"]
    assert GoalReached("1") in robot.events


async def test_pulled_camera_halts_and_is_explained(robot: Robot, golden: Golden) -> None:
    await follow(robot)
    robot.unplug("recorded-camera")
    await robot.until_goal("suspended")
    assert not robot.running
    golden.check_line("the camera is pulled", "\n".join(robot.told))
    [missing] = [event for event in robot.events if isinstance(event, PlanMissing)]
    assert any(told.startswith("cannot") and supplier(missing) in told for told in robot.told)


LIT = """(define (domain lamp) (:predicates (lit ?h - host))
    (:action shine :parameters (?u - light ?h - host) :precondition (ready ?u) :effect (lit ?h)))"""


async def test_goal_that_lost_its_words_names_the_component_that_brought_them(
    robot: Robot, golden: Golden
) -> None:
    (report,) = SPEAKER.behaviours
    shine = replace(report, name="shine", action="(shine ?u - light ?h - host)", lasting=True)
    lamp = replace(
        SPEAKER,
        name="lamp",
        units=(Unit("bulb", "light"),),
        fragments=(Fragment("domain.pddl", LIT),),
        behaviours=(replace(shine, phrases=()),),
    )
    robot.plug(lamp)
    robot.mind.give(pddl="(lit self)", kind="maintain")
    await robot.until_holding()
    robot.unplug("lamp")
    await robot.until_goal("suspended")
    [problem] = robot.mind.queue["1"].problems
    assert problem.code == "WHY_WORDS_GONE"
    golden.check("a component took its words along", str(problem))
    robot.plug(lamp)
    await robot.until_holding()


async def test_other_camera_takes_over(robot: Robot) -> None:
    await follow(robot)
    robot.unplug("recorded-camera")
    await robot.until_goal("suspended")
    robot.plug(THERMAL_CAMERA)
    await robot.until_holding()
    assert robot.running == {"thermal-camera.stream", *CHAIN}


async def test_spare_camera_fails_over_without_suspension(robot: Robot) -> None:
    plug_followers(robot)
    robot.plug(THERMAL_CAMERA)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding()
    [used] = {name.split(".")[0] for name in robot.running if name.endswith(".stream")}
    [spare] = {"recorded-camera", "thermal-camera"} - {used}
    robot.unplug(used)
    await robot.until(lambda: robot.running == {f"{spare}.stream", *CHAIN})
    assert not any(isinstance(event, PlanMissing) for event in robot.events)


async def test_unrelated_recomposition_keeps_plan_and_behaviours(robot: Robot) -> None:
    await follow(robot)
    started = list(robot.started)
    trees = robot.mind.pursuit.pursued.trees
    robot.plug(SPEAKER)
    await robot.until(lambda: robot.mind.pursuit.pursued.trees != trees)
    await robot.until(lambda: "speaker is here: it can report" in robot.told)
    assert robot.started == started
    assert len([e for e in robot.events if isinstance(e, PlanMade)]) == 1


async def test_restarting_component_is_waited_for(robot: Robot) -> None:
    await follow(robot)
    robot.set_state("visual-tracker", ComponentState.RESTARTING)
    await robot.until_goal("suspended")
    robot.set_state("visual-tracker", ComponentState.READY)
    await robot.until_holding()


async def test_died_behaviour_is_started_again(robot: Robot) -> None:
    await follow(robot)
    robot.call("track").end(RunState.FAILED, "lost the target")
    await robot.until(lambda: robot.started.count("visual-tracker.track") == 2)
    await robot.until(lambda: robot.mind.beliefs.world.holds(f"following {HOST} person"))
    assert robot.started.count("recorded-camera.stream") == 1


async def test_alternative_is_used_after_failures(robot: Robot) -> None:
    plug_followers(robot)
    robot.broken = {"recorded-camera"}
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_goal("suspended")
    assert [problem.code for problem in robot.mind.queue["1"].problems] == ["NO_OTHER_WAY"]
    assert robot.started == ["recorded-camera.stream"] * 3
    robot.plug(THERMAL_CAMERA)
    await robot.until_holding()
    assert "thermal-camera.stream" in robot.running


async def test_behaviour_that_is_established_and_fails_is_started_ever_less_often(
    robot: Robot, clock: VirtualClock, golden: Golden
) -> None:
    plug_followers(robot)
    robot.flapping = {"recorded-camera"}
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await clock.advance_until(robot.until_goal("suspended"))
    assert robot.started.count("recorded-camera.stream") == 3
    for tries, cool_down_s in ((4, 30.0), (5, 60.0), (6, 120.0)):
        await clock.advance(cool_down_s * 0.9)
        assert robot.started.count("recorded-camera.stream") == tries - 1
        again = robot.until(partial(has_tried, robot, tries))
        await clock.advance_until(again, step_s=1.0)
        await clock.advance_until(robot.until_goal("suspended"))
    golden.check("all that was tried failed", robot.mind.queue["1"].reason)
    golden.check("a behaviour failed six times", robot.mind.views.troubles()["recorded-camera"])


async def test_goal_says_how_what_is_tried_again_failed_the_last_time(
    robot: Robot, clock: VirtualClock, golden: Golden
) -> None:
    """A camera that never comes to send anything is overdue after a while, and started again."""
    plug_followers(robot)
    robot.stubborn = {"recorded-camera.stream"}
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await clock.advance_until(robot.until(lambda: robot.started != []))
    await clock.advance_until(robot.until(lambda: len(robot.started) == 2), step_s=1.0)
    goal = robot.mind.queue["1"]
    assert goal.state.value == "active"
    golden.check("an overdue behaviour is tried again", goal.reason)
    golden.check("a behaviour was overdue", robot.mind.views.troubles()["recorded-camera"])
    assert any("BEHAVIOUR_OVERDUE" in said for said in robot.mind.views.why()["sentences"])


async def test_behaviour_that_holds_for_a_while_is_no_trouble_any_more(
    robot: Robot, clock: VirtualClock
) -> None:
    plug_followers(robot)
    robot.broken = {"recorded-camera"}
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await clock.advance_until(robot.until_goal("suspended"))
    robot.broken = set()
    await clock.advance_until(robot.until_holding(), step_s=1.0)
    assert robot.mind.views.troubles()
    await clock.advance(11.0)
    assert not robot.mind.views.troubles()


async def test_restarted_worker_does_not_shorten_the_wait_of_what_failed(
    robot: Robot, clock: VirtualClock
) -> None:
    plug_followers(robot)
    robot.broken = {"recorded-camera"}
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await clock.advance_until(robot.until_goal("suspended"))
    for state in (ComponentState.RESTARTING, ComponentState.READY):
        robot.set_state("people-detector", state)
        await clock.advance(1.0)
    assert robot.mind.pursuit.exclusions.excluded
    robot.mounts = (*robot.mounts, MOUNT)
    robot.see()
    assert not robot.mind.pursuit.exclusions.excluded


async def test_host_that_is_gone_is_told_and_not_a_failure_of_its_behaviours(robot: Robot) -> None:
    await follow(robot)
    robot.unreachable = {"recorded-camera"}
    robot.call("stream").end(RunState.FAILED, "PEER_LOST")
    for _ in range(10):
        robot.mind.tick()
        await robot.until(lambda: not robot.mind.pursuit.is_searching)
    assert not [event for event in robot.events if isinstance(event, PlanMissing)]
    robot.unplug("recorded-camera")
    await robot.until_goal("suspended")
    [missing] = [event for event in robot.events if isinstance(event, PlanMissing)]
    assert supplier(missing) == "recorded-camera"


async def test_behaviour_of_a_host_that_is_back_is_started_again(robot: Robot) -> None:
    await follow(robot)
    robot.unreachable = {"recorded-camera"}
    robot.call("stream").end(RunState.FAILED, "PEER_LOST")
    robot.mind.tick()
    robot.unreachable = set()
    robot.see()
    await robot.until(lambda: robot.started.count("recorded-camera.stream") == 2)
    await robot.until_holding()


async def test_behaviour_that_never_establishes_makes_way_for_another() -> None:
    patience = Patience(establish_s=0.1)
    async with at_work(Robot(Planners.installed(memory_mb=512), patience=patience)) as robot:
        robot.stubborn = {"recorded-camera.stream"}
        plug_followers(robot)
        robot.plug(THERMAL_CAMERA)
        robot.set_state("thermal-camera", ComponentState.RESTARTING)
        robot.mind.give(pddl=FOLLOW, kind="maintain")
        await robot.until(lambda: robot.started.count("recorded-camera.stream") == 3)
        await robot.until_goal("suspended")
        robot.set_state("thermal-camera", ComponentState.READY)
        await robot.until_holding()
        assert "thermal-camera.stream" in robot.running
        assert any("BEHAVIOUR_OVERDUE" in text for text in robot.told)


async def test_valued_preconditions_travel_along(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    robot.stubborn = {"localise"}
    robot.mind.give(pddl=POINT, kind="maintain")
    await robot.until(lambda: robot.started == ["compton-camera.localise"])
    robot.know("compton-camera", "bearing-known", "radiation-source", "self", value=["bearing", 1])
    robot.call("localise").end(RunState.SUCCEEDED)
    await robot.until_holding()
    bearing = ("bearing-known", ("radiation-source", HOST))
    assert robot.call("point").values == ((*bearing, ["bearing", 1]),)
    robot.know("compton-camera", "bearing-known", "radiation-source", "self", value=["bearing", 2])
    assert robot.told_values == [("pan-tilt-unit", (*bearing, ["bearing", 2]))]


async def test_stalled_stream_is_restarted(robot: Robot) -> None:
    await follow(robot)
    robot.flow("recorded-camera", "frames", flowing=False)
    await robot.until(lambda: not robot.running & CHAIN)
    await robot.until(lambda: robot.started.count("recorded-camera.stream") == 2)
    await robot.until(lambda: robot.running == {"recorded-camera.stream", *CHAIN})


async def test_stalled_stream_that_comes_back_is_left_running(robot: Robot) -> None:
    await follow(robot)
    robot.flow("recorded-camera", "frames", flowing=False)
    await robot.until(lambda: not robot.running & CHAIN)
    robot.flow("recorded-camera", "frames", flowing=True)
    await robot.until(lambda: robot.running == {"recorded-camera.stream", *CHAIN})
    assert robot.started.count("recorded-camera.stream") == 1


async def test_more_urgent_goal_goes_first_and_the_other_returns(robot: Robot) -> None:
    await follow(robot)
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    robot.mind.give(pddl=POINT, priority=5)
    await robot.until_goal("reached", "2")
    await robot.until_holding("1")
    assert robot.running == {"recorded-camera.stream", *CHAIN}


async def test_goal_put_aside_returns_though_nothing_new_is_known(robot: Robot) -> None:
    robot.plug(BEACON)
    robot.mind.give(pddl=LIT_BEACON, kind="maintain")
    await robot.until_holding("1")
    robot.mind.give(pddl=REPORT, priority=5)
    await robot.until_goal("reached", "2")
    await robot.until_holding("1")
    assert robot.started == ["beacon.shine", "beacon.flash", "beacon.shine"]


async def test_goal_without_plan_does_not_interrupt(robot: Robot) -> None:
    await follow(robot)
    robot.plug(PAN_TILT_UNIT, COMPTON_CAMERA)
    robot.set_state("pan-tilt-unit", ComponentState.QUARANTINED)
    started = list(robot.started)
    robot.mind.give(pddl=POINT, priority=5)
    await robot.until_goal("suspended", "2")
    assert robot.started == started
    assert robot.mind.queue["1"].state.value == "active"


async def test_newer_goal_to_maintain_replaces_an_older_one_that_needs_the_same(
    robot: Robot,
) -> None:
    robot.plug(BEACON)
    robot.mind.give(pddl=LIT_BEACON, kind="maintain")
    await robot.until_holding("1")
    robot.mind.give(pddl=REPORT, kind="maintain")
    await robot.until_holding("2")
    assert robot.mind.queue["1"].state.value == "halted"
    await robot.until(lambda: robot.running == {"beacon.flash"})


async def test_halt_now_ends_everything_without_planner(robot: Robot) -> None:
    await follow(robot)
    names = robot.mind.halt(now=True)
    assert len(names) == 4
    await robot.until(lambda: not robot.running)
    assert robot.mind.queue["1"].state.value == "halted"
    assert not robot.mind.pursuit.pursued


async def test_one_goal_is_halted_alone(robot: Robot) -> None:
    await follow(robot)
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    waiting = robot.mind.give(pddl=POINT, kind="maintain", priority=-1)
    assert robot.mind.halt(id=waiting.id) == ()
    assert robot.mind.queue["1"].state.value == "active"
    with pytest.raises(GoalRefused, match=r"GOAL_UNKNOWN .*'9'"):
        robot.mind.halt(id="9")


async def test_goal_about_removed_words_is_suspended(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    robot.mind.give(pddl=POINT, kind="maintain")
    await robot.until_holding()
    robot.unplug("compton-camera")
    await robot.until_goal("suspended")
    assert "radiation-source" in robot.mind.queue["1"].reason
    robot.plug(COMPTON_CAMERA)
    await robot.until_holding()


async def test_unknown_goal_is_refused(robot: Robot) -> None:
    with pytest.raises(GoalRefused) as refused:
        robot.mind.give(pddl=POINT)
    assert refused.value.code == "PDDL_UNKNOWN"
    with pytest.raises(GoalRefused) as refused:
        robot.mind.give(words="make tea")
    assert refused.value.code == "PHRASE_UNKNOWN"


async def test_goal_that_holds_is_reached_at_once(robot: Robot) -> None:
    robot.plug(SPEAKER)
    robot.mind.give(pddl=f"(on {HOST}__speaker__voice self)")
    await robot.until_goal("reached")
    assert not robot.started


async def test_what_was_said_before_activation_counts(robot: Robot) -> None:
    robot.early_news["speaker"] = [FactKnown("speaker", "found", ("person", "self"))]
    robot.know("speaker", "reported", "person", "self")
    robot.plug(SPEAKER, PEOPLE_DETECTOR)
    assert robot.mind.beliefs.world.holds(f"found person {HOST}")
    assert not robot.mind.beliefs.world.holds(f"reported person {HOST}")


async def test_always_produced_stream_flows_without_behaviour(robot: Robot) -> None:
    unit = Unit("wheels", "base", outputs=(Output("odometry", "pose", always=True),))
    robot.plug(replace(MOBILE_BASE, units=(unit,)))
    stream = f"{HOST}__mobile-base__odometry"
    world = robot.mind.beliefs.world
    assert world.holds(f"from {stream} {HOST}")
    assert not world.holds(f"free {stream}")
    robot.flow("mobile-base", "odometry", flowing=True)
    assert world.holds(f"flowing {stream}")
    robot.flow("mobile-base", "odometry", flowing=False)
    assert not world.holds(f"flowing {stream}")


async def test_plugins_may_not_say_what_the_host_says(robot: Robot) -> None:
    robot.plug(SPEAKER)
    robot.forget("speaker", "ready", f"{HOST}__speaker__voice")
    robot.know("speaker", "self", "mule")
    facts = robot.mind.beliefs.world.facts
    assert f"ready {HOST}__speaker__voice" in facts
    assert "self mule" not in facts
    before = facts
    robot.know("speaker", "self mule")
    robot.know("speaker", "found", f"person {HOST}", "more")
    robot.know("speaker", twin("found"), "person", HOST)
    assert robot.mind.beliefs.world.facts == before


async def test_conflicting_component_is_named(robot: Robot) -> None:
    broken = replace(SPEAKER, fragments=(Fragment("domain.pddl", "(define (domain"),))
    robot.plug(MOBILE_BASE, broken)
    await robot.until(lambda: any("speaker is kept out of planning" in t for t in robot.told))
    assert robot.mind.views.why()["problems"]


KNOBS = " ".join(f"k{number}" for number in range(40))
TOO_WIDE = f"""(define (domain knobs) (:types knob - object) (:constants {KNOBS} - knob)
    (:predicates (turned ?a ?b ?c - knob))
    (:action turn :parameters (?u - speaker ?a ?b ?c ?d - knob ?h - host ?k - class)
                  :precondition (ready ?u) :effect (and (turned ?a ?b ?c) (following ?h ?k))))"""


def plug_knobs(robot: Robot) -> None:
    """A plugin that says its thousands of knobs make the robot follow."""
    (report,) = SPEAKER.behaviours
    action = "(turn ?u - speaker ?a ?b ?c ?d - knob ?h - host ?k - class)"
    turn = replace(report, name="turn", action=action, phrases=())
    fragment = Fragment("domain.pddl", TOO_WIDE)
    robot.plug(replace(SPEAKER, name="knobs", fragments=(fragment,), behaviours=(turn,)))


async def test_words_with_too_many_bindings_disturb_no_plan(robot: Robot) -> None:
    await follow(robot)
    plug_knobs(robot)
    await robot.until_holding()
    assert robot.started.count("drive") <= 1
    assert robot.running == {"recorded-camera.stream", *CHAIN}


async def test_component_with_too_many_bindings_is_kept_out_alone(robot: Robot) -> None:
    plug_followers(robot)
    plug_knobs(robot)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_holding()
    assert robot.running == {"recorded-camera.stream", *CHAIN}
    told = [text for text in robot.told if text.startswith("knobs is kept out of planning")]
    assert len(told) == 1
    [row] = robot.mind.views.kept_out()
    assert row["component"] == "knobs"
    assert row["problem"].startswith("PDDL_TOO_MANY knobs 1.0 domain.pddl:3")
    assert row["problem"] in robot.mind.views.why()["problems"]
    robot.unplug("knobs")
    await robot.until_holding()
    assert robot.mind.views.kept_out() == []
    assert all(said.is_over for said in robot.mind.people if said.about == "kept out knobs")


async def test_goal_that_only_a_component_kept_out_serves_says_so(robot: Robot) -> None:
    plug_knobs(robot)
    robot.mind.give(pddl="(turned k1 k2 k3)")
    await robot.until_goal("suspended")
    assert [p.code for p in robot.mind.queue["1"].problems] == ["PDDL_TOO_MANY"]


async def test_what_failed_is_told_with_its_last_reason(robot: Robot) -> None:
    robot.broken.add("recorded-camera")
    plug_followers(robot)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_goal("suspended")
    [problem] = robot.mind.queue["1"].problems
    assert problem.code == "NO_OTHER_WAY"
    assert "recorded-camera.stream" in problem.message
    assert problem.message.endswith("failed 3 times: no light")


async def test_what_failed_for_another_goal_is_not_told_as_a_reason(robot: Robot) -> None:
    robot.broken |= {"recorded-camera", "compton-camera"}
    plug_followers(robot)
    robot.plug(COMPTON_CAMERA)
    robot.mind.give(pddl=FOLLOW, kind="maintain")
    await robot.until_goal("suspended")
    robot.mind.give(pddl="(bearing-known radiation-source self)")
    await robot.until_goal("suspended", "2")
    for goal, mine, other in (("1", "recorded", "compton"), ("2", "compton", "recorded")):
        [problem] = robot.mind.queue[goal].problems
        assert (f"{mine}-camera." in problem.message, other in problem.message) == (True, False)


async def test_pulled_camera_is_told_with_the_payload_that_brings_it_back(
    robot: Robot, golden: Golden
) -> None:
    await follow(robot)
    robot.unplug("recorded-camera")
    await robot.until_goal("suspended")
    [told] = [text for text in robot.told if text.startswith("cannot")]
    timeless = re.sub(r"\d\d:\d\d:\d\d", "TIME", told)
    golden.check("a goal lacks what a component took along", timeless, goal=FOLLOW)


async def test_flood_of_news_costs_few_ticks(
    robot: Robot, monkeypatch: pytest.MonkeyPatch, clock: VirtualClock
) -> None:
    await clock.advance_until(follow(robot))
    ticks, tick = list[float](), robot.mind.tick

    def timed() -> None:
        ticks.append(clock.time())
        tick()

    monkeypatch.setattr(robot.mind, "tick", timed)
    for _ in range(500):
        robot.know("visual-tracker", "found", "person", HOST)
        robot.forget("visual-tracker", "found", "person", HOST)
        await clock.advance(0.0002)
    pauses = [later - earlier for earlier, later in itertools.pairwise(ticks)]
    assert min(pauses) >= PAUSE_S * 0.999
    assert robot.holds("1")
