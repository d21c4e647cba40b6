"""What a robot says of itself, of views as a real mind makes them and of ones made up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.host.mind.robot import Robot
from tests.kit.golden import Golden
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT

from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.device import DeviceClaim
from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.peer import PeerComponent, PeerRecord
from nondum.host.core.records.step import Step
from nondum.host.mind.announcements import Told
from nondum.host.mind.lack import Need
from nondum.host.mind.preview import Preview
from nondum.host.people.answering import Answering
from nondum.host.people.answers import LONGEST, abilities, activity, of_the_robot
from nondum.host.people.feedback.state_reasons import Known
from nondum.host.people.hosts_here import hosts_here
from nondum.host.people.obstacles import obstacle
from nondum.host.people.pulling import pulling
from nondum.host.people.reading_back import read_back
from nondum.host.people.recent import recent
from nondum.sdk.description import Label, PluginDescription
from nondum.sdk.errors import Problem

POINTING: PluginDescription = replace(
    PAN_TILT_UNIT,
    behaviours=tuple(replace(b, phrases=("point at {t}",)) for b in PAN_TILT_UNIT.behaviours),
)
SENSING = replace(COMPTON_CAMERA, labels=(Label("radiation-source", "the radiation source"),))
POINT = "point at the radiation source"


def can(words: str, now: str = "can", *needs: Need) -> dict[str, Any]:
    told = [need.to_dict() for need in needs]
    return {"words": words, "goal": f"({words})", "now": now, "needs": told}


def goal(
    text: str, state: str, reason: str = "", *needs: Need, holds: bool = False
) -> dict[str, Any]:
    told = [need.to_dict() for need in needs]
    return {"text": text, "state": state, "reason": reason, "needs": told, "holds": holds}


def nothing_of(*types: str, said: str = "in other words") -> Need:
    return Need("WHY_NO_OBJECT", said, types=types)


def step(component: str, state: str = "established") -> dict[str, Any]:
    return {"component": component, "state": state}


def answered(robot: Robot, coming: int = 0) -> str:
    return abilities(robot.mind.views.goals()()["can"], coming)


def known(robot: Robot, *drives: DriveRecord, unmounted: tuple[str, ...] = ()) -> Known:
    return Known(replace(robot.mind.beliefs.snapshot, drives=drives), unmounted)


@pytest.mark.anyio
async def test_robot_says_what_it_can_do_and_what_it_lacks(robot: Robot, golden: Golden) -> None:
    golden.check("nothing is plugged in", answered(robot))
    golden.check("nothing is plugged in, two payloads come", answered(robot, 2))
    robot.plug(POINTING)
    golden.check("no target to point at", answered(robot))
    robot.plug(SENSING)
    able = answered(robot)
    golden.check("can point", able, point=POINT)
    golden.check("can point, a payload comes", answered(robot, 1), point=POINT)
    robot.set_state("pan-tilt-unit", ComponentState.RESTARTING)
    await robot.until(lambda: answered(robot) != able)
    golden.check("the head is not ready", answered(robot), point=POINT)


@pytest.mark.anyio
async def test_component_that_waits_for_its_device_is_said_instead_of_what_it_lacks(
    robot: Robot, golden: Golden
) -> None:
    answering = Answering(robot.mind, lambda: known(robot), lambda: ())
    robot.plug(POINTING)
    needs = (DeviceClaim("head", {"usb": "*:*"}, optional=False),)
    unit = replace(robot.components["pan-tilt-unit"], devices=needs)
    robot.components["pan-tilt-unit"] = unit
    robot.see()
    told = await answering.own("what can you do")
    golden.check("no device, no target", told or "")
    robot.plug(SENSING)  # now it is the device alone
    told = await answering.own("what can you do")
    golden.check("no device", told or "")


@pytest.mark.anyio
async def test_robot_says_what_it_does(robot: Robot, golden: Golden) -> None:
    def said() -> str:
        views = robot.mind.views
        return activity(views.given(), views.plan()["steps"])

    golden.check("nothing was asked for", said())
    robot.plug(SENSING, POINTING)
    robot.mind.give(words=POINT)
    golden.check("a goal is planned for", said(), point=POINT)
    await robot.until_holding()
    golden.check("a goal is kept", said(), point=POINT)
    robot.set_state("pan-tilt-unit", ComponentState.RESTARTING)
    await robot.until_goal("suspended")
    golden.check("a goal waits for the head", said(), point=POINT)


def test_what_misses_the_same_is_said_once(golden: Golden) -> None:
    need = nothing_of("image")
    rows = [can("look for me", "cannot", need), can("follow me", "cannot", need), can("sing")]
    golden.check("two of three miss the same", abilities(rows))


def test_what_cannot_be_said_shortly_is_not_read_out(golden: Golden) -> None:
    need = Need("WHY_CIRCLE", "whatever makes (dark c) true needs it first", "dark c")
    told = abilities([can("sing"), can("dance", "cannot", need)])
    golden.check("what is missing is hard to say", told)
    told = abilities([can("look at {i}", "cannot", nothing_of("image", "depth"))])
    golden.check("one of two types is missing", told)


def test_what_means_two_things_or_is_not_known_is_not_promised(golden: Golden) -> None:
    rows = [can("sing", "ambiguous"), can("dance", "unknown"), can("greet <words>", "holds")]
    golden.check("only one of three can be promised", abilities(rows))


def test_a_long_list_is_cut_to_what_can_be_spoken(golden: Golden) -> None:
    rows = [can(f"carry the box number {number} to the other side") for number in range(30)]
    told = abilities(rows)
    assert len(told) <= LONGEST
    golden.check("thirty things can be done", told)


def test_lent_components_and_payloads_that_come_are_told_beside(golden: Golden) -> None:
    golden.check("only a peer uses something", activity([], [], {"eye"}))
    golden.check("nothing was asked for, two payloads come", activity([], [], (), 2))
    goals = [goal("sing", "queued"), goal("dance", "active", holds=True)]
    told = activity(goals, [step("band@mule")], {"eye"})
    golden.check("a goal is kept, another waits, a peer uses something", told)


def test_a_goal_that_is_worked_at_says_how_far_it_is(golden: Golden) -> None:
    steps = [step("", "done"), step("base", "running")]
    golden.check("one of two steps is done", activity([goal("look for me", "active")], steps))


def test_a_goal_in_pddl_is_not_turned_into_words(golden: Golden) -> None:
    told = activity([goal("(lit rover)", "active", holds=True)], [])
    golden.check("a goal in PDDL is kept", told)


def test_what_is_missing_is_told_by_data_whatever_the_sentences_say(golden: Golden) -> None:
    said = "(ready rover__gun__it) does not hold: gun waits for its device it"
    image = nothing_of("image", said=said)
    golden.check("nothing gives an image", abilities([can("look", "cannot", image)]))
    told = activity([goal("look", "suspended", said, image)], [])
    golden.check("a goal waits for an image", told)
    waits = Need("WHY_NOT_SO", "no power", "ready rover__gun__it", waits=True)
    told = abilities([can("shoot", "cannot", waits)], 0, ["gun has no power"])
    golden.check("a component says why it waits", told)


@given(st.text(), st.text(), st.lists(st.text(), max_size=8))
def test_whatever_strangers_write_an_answer_can_be_spoken(
    words: str, reason: str, names: list[str]
) -> None:
    needs = (nothing_of(reason), Need("WHY_NOT_SO", reason, f"ready {reason}"))
    rows = [can(words, "cannot", *needs), can(words, "can"), *(can(name) for name in names)]
    steps = [step(name) for name in names]
    for state in ("active", "queued", "suspended"):
        for told in ((), needs[:1], needs[1:]):
            assert len(activity([goal(words, state, reason, *told)], steps, names)) <= LONGEST
    assert len(abilities(rows)) <= LONGEST


def test_who_speaks_is_somebody_else(golden: Golden) -> None:
    told = of_the_robot("Tell me where my car is, and you yourself")
    golden.check("a sentence is said back", told)


@pytest.mark.anyio
async def test_robot_says_why_it_does_not_do_what_was_asked_for(
    robot: Robot, golden: Golden
) -> None:
    answering = Answering(robot.mind, lambda: known(robot), lambda: ())

    async def told(words: str) -> str:
        return await answering.own(words) or ""

    golden.check("why not, nothing is plugged in", await told(f"why can't you {POINT}"))
    golden.check("why not, nothing was asked for", await told("why not"))
    robot.plug(POINTING)
    golden.check("why not, there is nothing to name", await told(f"why can't you {POINT}"))
    golden.check("why not, no phrase says it", await told("why don't you sing for me"))
    robot.plug(SENSING)
    golden.check("why not, it can", await told(f"why don't you {POINT}"), point=POINT)
    robot.mind.give(words=POINT)
    await robot.until_holding()
    golden.check("why not, it does", await told(f"why won't you {POINT}"), point=POINT)
    golden.check("why not, all is well", await told("what is missing"))
    robot.set_state("pan-tilt-unit", ComponentState.RESTARTING)
    await robot.until_goal("suspended")
    golden.check("why not, the head is not ready", await told("why not"), point=POINT)
    golden.check("why not that, no head", await told(f"why can't you {POINT}"), point=POINT)
    robot.mind.halt()
    golden.check("why not, it was halted", await told("why not"), point=POINT)


@pytest.mark.anyio
async def test_robot_says_what_happened_but_not_what_it_answered(
    robot: Robot, golden: Golden
) -> None:
    answering = Answering(robot.mind, lambda: known(robot), lambda: ())
    assert await answering.answer("what happened") == "Nothing yet."
    robot.mind.people.tell("eye is here: it can look")
    first = await answering.answer("what happened")
    golden.check("what happened: a component came", first or "")
    assert await answering.answer("what is new") == first


@pytest.mark.parametrize(
    ("state", "in_words", "as_formula"),
    [
        ("queued", "why not, queued", "why not, queued, PDDL"),
        ("kept", "why not, kept", "why not, kept, PDDL"),
        ("halted", "why not, halted", "why not, halted, PDDL"),
    ],
)
def test_goal_that_waits_says_what_for(
    golden: Golden, state: str, in_words: str, as_formula: str
) -> None:
    golden.check(in_words, obstacle([goal("dance", state, "waits for goal 3")]))
    golden.check(as_formula, obstacle([goal("(lit rover)", state)]))


def test_goal_that_is_pursued_still_is_said_to_be(golden: Golden) -> None:
    golden.check("why not, active", obstacle([goal("dance", "active")]))


def told_at(*texts: str, every_s: float = 60.0) -> list[Told]:
    return [Told(number, number * every_s, text) for number, text in enumerate(texts, 1)]


@pytest.mark.parametrize(
    ("situation", "every_s", "texts"),
    [
        ("two things happened", 45.0, ["eye is here", "lamp is refused: X it is dark → light it"]),
        ("an hour passed", 1800.0, ["eye is here", "eye is gone"]),
        ("days passed", 90_000.0, ["eye is here"]),
        ("more happened than can be spoken", 60.0, [f"{n} {'is here' * 8}" for n in range(9)]),
        ("one thing happened that is too long", 60.0, ["is here " * 40]),
    ],
)
def test_what_happened_is_told_with_how_long_ago(
    golden: Golden, situation: str, every_s: float, texts: list[str]
) -> None:
    told = recent(told_at(*texts, every_s=every_s), len(texts) * every_s + every_s)
    golden.check(situation, told)
    assert len(told) <= LONGEST


@pytest.mark.anyio
async def test_robot_says_which_drives_may_be_pulled(robot: Robot, golden: Golden) -> None:
    drive = DriveRecord("sdb1-7", "block", Path("/mnt"), state=DriveState.IDLE)
    robot.plug(POINTING)
    (component,) = robot.components.values()
    payload = PayloadRecord(
        key=component.payload,
        digest="d",
        payload_id=component.payload_id,
        version="1",
        release=1,
        fleet="",
        step=Step.ACTIVE,
        sources={"sdb1-7": Path("/mnt/nondum/x")},
        phases={},
    )
    snapshot = replace(robot.mind.beliefs.snapshot, payloads=(payload,), drives=(drive,))

    def told(used: str = "", *, unmounted: bool = True, **changes: Any) -> str:
        seen = replace(snapshot, **changes)
        return pulling(Known(seen, ("sdb1-7",) if unmounted else ()), {used})

    golden.check("pull: no drive", told(drives=()))
    golden.check("pull: its payload is active", told())
    golden.check("pull: its component acts", told("pan-tilt-unit"))
    staged = replace(payload, step=Step.STAGED)
    golden.check("pull: it is being installed", told(payloads=(staged,)))
    reading = replace(drive, state=DriveState.READING)
    golden.check("pull: it is being read", told(drives=(reading,), unmounted=False))
    golden.check("pull: it is mounted", told(unmounted=False))
    refused = replace(payload, step=Step.REFUSED)
    golden.check("pull: its payload is refused", told(payloads=(refused,)))
    broken = replace(drive, problems=(Problem("FS_UNSUPPORTED", "no file system"),))
    golden.check("pull: it cannot be read", told(payloads=(), drives=(broken,), unmounted=False))
    many = tuple(replace(drive, id=f"sd{letter}1-{letter}") for letter in "cdefghij")
    golden.check("pull: nine drives", told(drives=(*many, drive)))


def test_robot_says_who_is_here(golden: Golden) -> None:
    def peer(name: str, *components: str) -> PeerRecord:
        payload = ("life", "org.example.x", "1", POINTING)
        offered = tuple(
            PeerComponent(f"{one}@{name}", *payload, is_ready=True, rank=1) for one in components
        )
        return PeerRecord("key", name, "address", "pairing", "life", offered)

    golden.check("who: no other host", hosts_here("rover", ()))
    one = (peer("mule", "eye", "lamp"),)
    golden.check("who: one with two components", hosts_here("rover", one))
    two = (peer("mule", "a", "b", "c", "d"), peer("llama"))
    golden.check("who: two", hosts_here("rover", two))
    golden.check("who: thirty", hosts_here("rover", [peer(f"mule-{n:02}") for n in range(30)]))


@pytest.mark.anyio
async def test_robot_says_what_it_would_do_before_it_is_told_to(
    robot: Robot, golden: Golden
) -> None:
    def told(words: str) -> str:
        mind, composition = robot.mind, robot.mind.composition
        assert composition is not None
        goal = composition.book.goal(words)
        return read_back(words, mind.views.preview(goal)())

    robot.plug(POINTING, SENSING)
    golden.check("it would point", told(POINT), point=POINT)
    robot.mind.give(words=POINT)
    await robot.until_holding()
    golden.check("it would point, which it does already", told(POINT), point=POINT)
    robot.set_state("pan-tilt-unit", ComponentState.RESTARTING)
    await robot.until_goal("suspended")
    golden.check("it would point, but has no head", told(POINT), point=POINT)


def test_what_a_robot_would_do_is_short_enough_to_be_spoken(golden: Golden) -> None:
    steps = tuple(f"component-{n}.do" for n in range(9))
    components = tuple(f"component-{n}@mule" for n in range(9))
    golden.check(
        "nine steps at a peer", read_back("look for me", Preview("can", steps, components))
    )
    golden.check("two steps", read_back("sing", Preview("can", steps[:2], ("choir",))))
    golden.check("PDDL", read_back("(lit rover)", Preview("can", ("lamp.shine",), ("lamp",))))
    golden.check("too many ways", read_back("sing", Preview("unknown")))
