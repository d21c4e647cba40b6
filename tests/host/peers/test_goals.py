"""Words that a peer heard become a goal here only if this host takes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from nondum.host.mind.component_plugins import Answers
from nondum.host.mind.mind import Mind
from nondum.host.peers.forwarded_goals import MOST_KEPT
from nondum.host.peers.goals import MAX_WORDS, Goals
from nondum.host.people.stopping import Stopped
from nondum.sdk.wire import Body
from nondum.transport.peers import Admission, Call, CallFailed, IncomingCall, PeerKey
from nondum.transport.peers.messages import Request

pytestmark = pytest.mark.anyio


class NoPeer:
    """No peer is reached."""

    def call(self, host: str, method: str, args: Body, *, deadline_s: float) -> Call:
        raise AssertionError(f"{host} is asked for {method}")

    def notify(self, host: str, method: str, args: Body) -> None:
        raise AssertionError(f"{host} is told {method}")


def no_mind() -> Mind:
    raise AssertionError("a goal is made of it")


def no_translations(words: str, vocabulary: Mapping[str, Any]) -> Answers:
    raise AssertionError("words were translated")


def no_stop() -> Stopped:
    raise AssertionError("it is stopped")


def asked(words: object) -> IncomingCall:
    admission = Admission(PeerKey("rover"), "rover", "pairing")
    request = Request(1, 1, 60_000, "goal.give", {"words": words})
    return IncomingCall(admission, request, lambda _, __: None)


@pytest.mark.parametrize(
    ("words", "accepts", "code"),
    [
        (7, True, "CALL_MALFORMED"),
        (None, True, "CALL_MALFORMED"),
        ("", True, "CALL_MALFORMED"),
        (["search"], True, "CALL_MALFORMED"),
        ("x" * (MAX_WORDS + 1), True, "CALL_MALFORMED"),
        ("search for people", False, "GOALS_NOT_TAKEN"),
    ],
    ids=["number", "none", "empty", "list", "long", "not taken"],
)
async def test_words_that_are_not_taken_become_no_goal(
    words: Any, accepts: bool, code: str
) -> None:
    goals = Goals("mule", no_mind, NoPeer(), lambda: (), no_stop, no_translations, accepts=accepts)
    with pytest.raises(CallFailed, match=code):
        goals.serve_give(asked(words))
    with pytest.raises(CallFailed, match=code):
        await goals.serve_ask(asked(words))


@pytest.mark.parametrize("priority", [1001, -1001, True, "1", 1.5])
async def test_goal_of_no_priority_that_there_is_is_refused(priority: Any) -> None:
    goals = Goals("mule", no_mind, NoPeer(), lambda: (), no_stop, no_translations, accepts=True)
    incoming = asked("blink")
    incoming.args["priority"] = priority
    with pytest.raises(CallFailed, match="CALL_MALFORMED"):
        goals.serve_give(incoming)


@pytest.mark.parametrize(
    "goals",
    [None, 7, [], {}, {str(number): "blink" for number in range(MOST_KEPT + 1)}],
    ids=["nothing", "number", "list", "none", "too many"],
)
async def test_peer_that_is_back_asks_after_goals_by_id(goals: Any) -> None:
    goals_here = Goals(
        "mule", no_mind, NoPeer(), lambda: (), no_stop, no_translations, accepts=True
    )
    incoming = asked("blink")
    incoming.args["goals"] = goals
    with pytest.raises(CallFailed, match="CALL_MALFORMED"):
        await goals_here.serve_again(incoming)
