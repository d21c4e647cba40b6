"""What peers tell of goals that they were given is shown, and nothing else of what they tell."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from nondum.host.peers.forwarded_goals import (
    LONGEST,
    MOST_KEPT,
    MOST_PROBLEMS,
    MOST_REPLACED,
    ForwardedGoals,
    goal_status,
)
from nondum.sdk.errors import GoalRefused

pytestmark = pytest.mark.anyio

ANSWER = {"goal": "7", "text": "blink", "pddl": "(seen rover)", "kind": "achieve"}


def given() -> ForwardedGoals:
    away = ForwardedGoals()
    away.add("rover", "blink", 0, ANSWER)
    return away


def told(**more: Any) -> dict[str, Any]:
    goal_status = {"goal": "7", "state": "active", "reason": "", "holds": True, "problems": []}
    return {**goal_status, "replaces": [], **more}


async def test_row_names_the_host_of_the_goal_and_its_state() -> None:
    away = given()
    away.hear("rover", told(problems=[{"code": "WHY_X", "message": "no", "fix": "do"}]))
    (row,) = away.rows()
    assert (row["host"], row["id"], row["goal"], row["text"]) == (
        "rover",
        "7",
        "(seen rover)",
        "blink",
    )
    assert (row["state"], row["holds"], row["problems"][0]["code"]) == ("active", True, "WHY_X")
    assert goal_status(row) == told(problems=[{"where": "", **row["problems"][0]}])


async def test_follower_is_told_of_each_change_and_of_the_loss_of_the_host() -> None:
    away = given()
    rows = away.follow("rover", "7")
    assert (await anext(rows))["state"] == "queued"
    following = asyncio.ensure_future(anext(rows))
    await asyncio.sleep(0)
    away.hear("rover", told())
    assert (await following)["state"] == "active"
    following = asyncio.ensure_future(anext(rows))
    await asyncio.sleep(0)
    away.lose("rover")
    lost = await following
    assert (lost["state"], lost["holds"]) == ("unknown", False)


async def test_goal_that_is_over_stays_so_when_its_host_goes() -> None:
    away = given()
    away.hear("rover", told(state="reached"))
    away.lose("rover")
    assert away.rows()[0]["state"] == "reached"


async def test_goal_that_was_not_given_is_not_followed() -> None:
    with pytest.raises(GoalRefused, match="GOAL_UNKNOWN"):
        await anext(given().follow("mule", "7"))


@pytest.mark.parametrize(
    ("peer", "goal"), [("mule", "7"), ("rover", "8"), ("rover", 7), ("rover", None)]
)
async def test_peer_tells_nothing_of_goals_that_it_was_not_given(peer: str, goal: Any) -> None:
    away = given()
    before = away.rows()[0].copy()
    away.hear(peer, told(goal=goal))
    assert away.rows() == [before]


async def test_peer_tells_which_goal_the_new_one_replaces() -> None:
    away, older = ForwardedGoals(), {"id": "6", "text": "shine", "is_over": False}
    row = away.add("rover", "blink", 0, {**ANSWER, "replaces": [older]})
    assert row["replaces"] == [older]
    away.hear("rover", told(replaces=[{**older, "is_over": True}]))
    assert away.rows()[0]["replaces"] == [{**older, "is_over": True}]
    assert goal_status(away.rows()[0])["replaces"] == [{**older, "is_over": True}]


async def test_what_a_peer_tells_is_bounded_and_plain() -> None:
    away = given()
    away.hear(
        "rover",
        told(
            state="x" * (LONGEST + 1),
            reason="\x1b[2J",
            holds="yes",
            problems=[{"message": 7}, "no problem", *[{}] * 100],
            replaces=[{"text": "\x1b" * 3, "is_over": "yes"}, 7, *[{}] * 100],
        ),
    )
    (row,) = away.rows()
    assert len(row["state"]) == LONGEST
    assert "\x1b" not in row["reason"]
    assert row["holds"] is False
    assert len(row["problems"]) <= MOST_PROBLEMS
    assert len(row["replaces"]) < MOST_REPLACED
    assert "\x1b" not in row["replaces"][0]["text"]
    assert row["replaces"][0]["is_over"] is False
    away.hear("rover", {"goal": "7", "problems": 3, "replaces": 3})
    for number in range(MOST_KEPT + 5):
        away.add("rover", "blink", 0, ANSWER | {"goal": str(number + 10)})
    assert len(away.rows()) == MOST_KEPT
