"""What the mind shows: plain data that JSON can carry."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from tests.host.mind.robot import HOST, Robot
from tests.kit.golden import Golden
from tests.planning.strangers import (
    COMPTON_CAMERA,
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    RECORDED_CAMERA,
    VISUAL_TRACKER,
)

from nondum.host.core.events.behaviours import BehaviourProgressed
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.mount import MountPose
from nondum.sdk.description import (
    Behaviour,
    Fragment,
    Label,
    Phrase,
    PluginDescription,
    Unit,
)
from nondum.sdk.errors import FragmentRefused

pytestmark = pytest.mark.anyio

CRYSTAL, HEAD = f"{HOST}__compton-camera__crystal", f"{HOST}__pan-tilt-unit__head"
POINTING: PluginDescription = replace(
    PAN_TILT_UNIT,
    behaviours=tuple(replace(b, phrases=("point at {t}",)) for b in PAN_TILT_UNIT.behaviours),
)
SENSING = replace(COMPTON_CAMERA, labels=(Label("radiation-source", "the radiation source"),))


async def point(robot: Robot) -> None:
    robot.plug(SENSING, POINTING)
    robot.mind.give(words="point at the radiation source")
    await robot.until_holding()


async def test_goal_in_words_of_two_strangers(robot: Robot) -> None:
    robot.plug(SENSING, POINTING)
    [can] = robot.mind.views.goals()()["can"]
    goal = f"(pointing {HOST} radiation-source)"
    assert can == {
        "words": "point at the radiation source",
        "goal": goal,
        "kind": "maintain",
        "now": "can",
        "lacks": [],
        "needs": [],
        "from": ["compton-camera", "pan-tilt-unit"],
    }
    given = robot.mind.give(words="point at the radiation source")
    assert (given.pddl, given.kind) == (goal, "maintain")
    await robot.until_holding()


async def test_goals_say_what_holds_and_what_is_missing(robot: Robot) -> None:
    await point(robot)
    assert [row["now"] for row in robot.mind.views.goals()()["can"]] == ["holds"]
    unready = ComponentState.RESTARTING
    robot.set_state("pan-tilt-unit", unready)
    await robot.until_goal("suspended")
    [row] = robot.mind.views.goals()()["can"]
    assert row["now"] == "cannot"
    assert f"(ready {HEAD}) does not hold" in row["lacks"][0]
    need = row["needs"][0]
    assert (need["code"], need["fact"], need["waits"]) == ("WHY_NOT_SO", f"ready {HEAD}", False)
    assert robot.mind.views.given()[0]["needs"] == row["needs"]


async def test_phrase_without_anything_to_name_is_listed_with_what_it_lacks(
    robot: Robot, golden: Golden
) -> None:
    robot.plug(POINTING)
    view = robot.mind.views.goals()()
    [row] = view["can"]
    assert (row["words"], row["goal"]) == ("point at {t}", "(pointing self ?t)")
    assert row["now"] == "cannot"
    golden.check("nothing can be named", "\n".join(row["lacks"]))
    assert [(need["code"], need["types"]) for need in row["needs"]] == [
        ("WHY_NO_OBJECT", ["target"])
    ]
    [phrase] = view["phrases"]
    assert phrase["slots"] == [{"slot": "t", "types": ["target"], "values": []}]


async def test_goal_that_cannot_be_had_names_who_used_to_help(robot: Robot) -> None:
    robot.plug(SENSING, POINTING)
    places = "(define (problem lab) (:domain lab) (:objects radiation-source - target))"
    robot.plug(PluginDescription("lab", "1", fragments=(Fragment("lab.pddl", places),)))
    robot.unplug("compton-camera")
    [row] = robot.mind.views.goals()()["can"]
    assert row["now"] == "cannot"
    assert any(text.startswith("compton-camera ") for text in row["lacks"])


async def test_goal_that_speaks_of_too_much_is_listed_as_unknown(robot: Robot) -> None:
    pins = " ".join(f"pin{number}" for number in range(100))
    words = f"""(define (domain pins) (:types pin - object) (:constants {pins} - pin)
        (:predicates (up ?p - pin) (near ?p ?q ?r - pin))
        (:action lift :parameters (?u - speaker ?p ?q - pin) :precondition (ready ?u)
          :effect (and (up ?p) (near ?p ?q ?p))))"""
    wide = "(forall (?a ?b ?c ?d ?e - pin) (or (up ?a) (near ?b ?c ?d) (not (up ?e))))"
    robot.plug(
        PluginDescription(
            name="pins",
            version="1.0",
            units=(Unit("panel", "speaker"),),
            fragments=(Fragment("pins.pddl", words),),
            phrases=(Phrase("tidy up", wide), Phrase("lift it", "(up pin3)")),
            behaviours=(Behaviour("lift", "(lift ?u - speaker ?p ?q - pin)"),),
        )
    )
    now = {row["words"]: row["now"] for row in robot.mind.views.goals()()["can"]}
    assert now == {"tidy up": "unknown", "lift it": "can"}


async def test_words_with_two_meanings_are_listed_as_ambiguous(robot: Robot) -> None:
    finding = Phrase("point at {t:target}", "(bearing-known ?t self)")
    robot.plug(replace(SENSING, phrases=(finding,)), POINTING)
    rows = robot.mind.views.goals()()["can"]
    assert [row["now"] for row in rows] == ["ambiguous", "ambiguous"]
    assert {row["goal"].split()[0] for row in rows} == {"(pointing", "(bearing-known"}


async def test_plan_shows_steps_and_why(robot: Robot, golden: Golden) -> None:
    await point(robot)
    plan = robot.mind.views.plan()
    assert plan["goal"] == f"(pointing {HOST} radiation-source)"
    rows = [(row["step"], row["state"]) for row in plan["steps"]]
    assert rows == [(1, "done"), (2, "established")]
    golden.check("a step is done", plan["steps"][0]["why"])
    golden.check("a step is established", plan["steps"][1]["why"])


async def test_progress_stands_apart_from_why_a_step_runs(robot: Robot) -> None:
    await point(robot)
    why = robot.mind.views.plan()["steps"][-1]["why"]
    call = robot.calls[-1]
    robot.mind.on_event(BehaviourProgressed(call.component, call.behaviour, call.id, 0.5, "aimed"))
    assert robot.mind.views.plan()["steps"][-1]["why"] == f"{why}; 50% aimed"


async def test_no_plan_is_shown_as_none(robot: Robot) -> None:
    assert robot.mind.views.plan() == {"goal": None, "kind": None, "steps": [], "beside": []}


async def test_facts_are_explained(robot: Robot, golden: Golden) -> None:
    await point(robot)
    rows = {row["fact"]: row["source"] for row in robot.mind.views.facts()}
    golden.check("a unit is ready", rows[f"ready {HEAD}"])
    golden.check("a fragment states a fact", rows[f"senses {CRYSTAL} radiation-source"])
    found = robot.mind.views.fact(f"(idle {HEAD})")
    assert (found["fact"], found["holds"]) == (f"idle {HEAD}", False)
    [speaks_for] = found["for"]
    assert speaks_for["component"] == ""
    golden.check("a unit is idle", speaks_for["said"])
    [against] = found["against"]
    assert (against["component"], against["behaviour"]) == ("pan-tilt-unit", "point")
    assert found["denied_by"] == ["pan-tilt-unit.point"]
    assert all(word["age_s"] >= 0.0 for word in (*found["for"], against))


async def test_fact_is_explained_however_it_is_written(robot: Robot) -> None:
    await point(robot)
    for asked in (f"(IDLE {HEAD})", f"idle {HEAD}", f"(not (idle {HEAD}))", f" (idle\n{HEAD} )"):
        assert robot.mind.views.fact(asked)["fact"] == f"idle {HEAD}"
    for asked, place in {
        f"(and (idle {HEAD}))": "fact:1:2",
        f"(idle {HEAD}) (self self)": f"fact:1:{len(HEAD) + 9}",
        "(idle": "fact:1:6",
        "(= self rover)": "fact:1:2",
    }.items():
        with pytest.raises(FragmentRefused) as error:
            robot.mind.views.fact(asked)
        assert error.value.problems[0].where == place


async def test_fact_of_an_absent_object_is_parked(robot: Robot) -> None:
    robot.plug(SENSING, POINTING)
    robot.know("compton-camera", "bearing-known", "moon", "self")
    [row] = robot.mind.views.parked()
    assert (row["fact"], row["absent"]) == (f"bearing-known moon {HOST}", ["moon"])
    found = robot.mind.views.fact("(bearing-known moon self)")
    assert found["absent"] == ["moon"]
    assert found["hint"].startswith("there is no object 'moon' now")
    assert found["assumed_by"] == ["compton-camera.localise"]


async def test_observers_that_disagree_are_told_once(robot: Robot) -> None:
    words = "(define (domain cups) (:predicates (at ?c - class ?p - place)) (:functional at))"
    places = "(define (problem cups) (:domain cups) (:objects cup - class hall attic - place))"
    fragments = (Fragment("domain.pddl", words), Fragment("problem.pddl", places))
    left, right = (PluginDescription(name, "1", fragments=fragments) for name in ("left", "right"))
    robot.plug(left, right)
    await robot.until(lambda: robot.mind.beliefs.world.revision > 0)
    robot.know("left", "at", "cup", "hall")
    robot.know("right", "at", "cup", "attic")
    await robot.until(lambda: any("PDDL_FACT_CONFLICT" in text for text in robot.told))
    robot.know("left", "at", "cup", "hall")
    await robot.until(lambda: robot.mind.beliefs.world.holds("at cup hall"))
    assert sum("PDDL_FACT_CONFLICT" in text for text in robot.told) == 1
    assert any("PDDL_FACT_CONFLICT" in problem for problem in robot.mind.views.why()["problems"])
    assert robot.mind.views.fact("at cup attic")["instead"] == "at cup hall"


async def test_why_tells_what_is_missing(robot: Robot, golden: Golden) -> None:
    await point(robot)
    robot.unplug("pan-tilt-unit")
    await robot.until_goal("suspended")
    view = robot.mind.views.why()
    golden.check_line("a goal is suspended", "\n".join(view["sentences"]))
    assert any(problem.startswith("WHY_SUPPLIER pan-tilt-unit ") for problem in view["problems"])


async def test_units_show_mounts_and_doubts(robot: Robot, golden: Golden) -> None:
    robot.mounts = (MountPose(HEAD, (0.0, 0.0, 50.0), (0.0, 0.0, 0.0), "person"),)
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT)
    rows = {row["unit"]: row for row in robot.mind.views.units()}
    assert rows[CRYSTAL]["mount"] == "unknown"
    (doubt,) = rows[HEAD]["warnings"]
    golden.check("a mount is far away", doubt)
    [told] = [text for text in robot.told if " 50 " in text]
    golden.check("a mount far away is told", told)


async def test_behaviours_show_what_runs(robot: Robot) -> None:
    await point(robot)
    rows = {row["behaviour"]: row for row in robot.mind.views.behaviours()}
    assert rows["point"]["running"] is True
    assert rows["localise"] == {
        "behaviour": "localise",
        "component": "compton-camera",
        "kind": "finishing",
        "running": False,
        "phrases": [],
        "problem": "",
    }


async def test_behaviours_show_the_phrases_of_any_component_that_ask_for_them(
    robot: Robot,
) -> None:
    phrase = Phrase("aim at {t:target}", "(pointing self ?t)", "maintain")
    robot.plug(replace(SENSING, phrases=(phrase,)), POINTING)
    rows = {row["behaviour"]: row for row in robot.mind.views.behaviours()}
    assert rows["point"]["phrases"] == ["point at {t}", "aim at {t:target}"]
    assert rows["localise"]["phrases"] == []


async def test_behaviours_of_what_is_kept_out_of_planning_say_so(robot: Robot) -> None:
    broken = replace(PAN_TILT_UNIT, fragments=(Fragment("domain.pddl", "(define (domain"),))
    robot.plug(broken)
    [row] = robot.mind.views.behaviours()
    assert "PDDL_SYNTAX" in row["problem"]


async def test_plans_are_told_in_short_and_kept_whole(robot: Robot) -> None:
    await point(robot)
    [plan] = [text for text in robot.told if text.startswith("plan for")]
    assert plan.endswith(": compton-camera.localise, then pan-tilt-unit.point")
    steps = {row["told"]: row["action"] for row in robot.mind.views.plan()["steps"]}
    assert HEAD in steps["pan-tilt-unit.point"]
    assert not any("__" in sentence for sentence in robot.mind.views.why()["sentences"])


async def test_units_that_a_behaviour_uses_are_not_said_to_be_unused(robot: Robot) -> None:
    robot.plug(COMPTON_CAMERA, PAN_TILT_UNIT, RECORDED_CAMERA, PEOPLE_DETECTOR)
    robot.plug(VISUAL_TRACKER, MOBILE_BASE)
    robot.mind.give(pddl="(following self person)", kind="maintain")
    await robot.until_holding()
    said = {row["fact"]: row["source"] for row in robot.mind.views.facts()}
    unused = {fact for fact, source in said.items() if source == "nothing uses it"}
    assert f"idle {CRYSTAL}" in unused
    assert f"idle {HOST}__people-detector__hog" not in unused
    assert "people-detector.detect uses it" in said[f"idle {HOST}__people-detector__hog"]


async def test_what_was_told_of_something_that_is_gone_is_over(robot: Robot) -> None:
    people = robot.mind.people
    people.tell("drive photos carries no payload", "drive photos")
    people.tell("drive tools is full", "drive tools")
    people.end("drive photos")
    assert [row["over"] for row in robot.mind.views.told()] == [True, False]


async def test_streams_show_flow(robot: Robot) -> None:
    robot.plug(RECORDED_CAMERA)
    robot.flow("recorded-camera", "frames", flowing=True)
    assert robot.mind.views.streams()[0]["flowing"] is True


async def test_everything_is_plain_data(robot: Robot) -> None:
    await point(robot)
    views = robot.mind.views
    shown = [views.plan(), views.tree(), views.facts(), views.goals()(), views.why()]
    shown += [views.behaviours(), views.units(), views.streams(), views.told()]
    assert json.loads(json.dumps(shown)) == shown
