"""Spoken words become a goal, an answer, or a sentence on why not."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.host.mind.robot import Robot
from tests.kit.golden import Golden
from tests.planning.strangers import COMPTON_CAMERA, PAN_TILT_UNIT

from nondum.host.people.conversation import Conversation, wanted
from nondum.sdk.description import Label
from nondum.sdk.errors import GoalRefused, Problem

pytestmark = pytest.mark.anyio

LISTENER = "microphone"
WORDS = "point at the radiation source"


def told(robot: Robot) -> list[str]:
    return [row["text"] for row in robot.mind.views.told()]


async def take(words: str) -> str:
    raise AssertionError(f"a goal is made of {words!r}")


async def test_question_without_an_answer_is_told_and_makes_no_goal(robot: Robot) -> None:
    async def answer(words: str) -> str | None:
        raise GoalRefused(Problem("METHOD_UNKNOWN", f"made up for {words}"))

    hearing = Conversation(robot.mind, dict, take, answer)
    await hearing.on_words(LISTENER, "mule, what can you do")
    assert any("METHOD_UNKNOWN" in sentence for sentence in told(robot))


async def test_answer_is_not_told_twice(robot: Robot) -> None:
    async def answer(words: str) -> str | None:
        return "I can blink."

    before = told(robot)
    await Conversation(robot.mind, dict, take, answer).on_words(LISTENER, "what can you do")
    assert told(robot) == before


async def test_spoken_goal_says_which_one_it_replaces(robot: Robot, golden: Golden) -> None:
    sensing = replace(COMPTON_CAMERA, labels=(Label("radiation-source", "the radiation source"),))
    phrases = tuple(replace(b, phrases=("point at {t}",)) for b in PAN_TILT_UNIT.behaviours)
    robot.plug(sensing, replace(PAN_TILT_UNIT, behaviours=phrases))
    golden.check("a goal is spoken", wanted(robot.mind, WORDS))
    golden.check("the same goal is spoken again", wanted(robot.mind, WORDS), words=WORDS)
