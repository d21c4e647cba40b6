"""A question that names a peer is answered by it, and a peer that cannot is said to be older."""

from __future__ import annotations

from typing import Any

import pytest
from tests.host.peers.one_peer import OnePeer, incoming

from nondum.host.peers.asking import METHOD, Asking
from nondum.host.peers.goals import MAX_WORDS
from nondum.sdk.errors import GoalRefused, HostUnreachable, Problem
from nondum.sdk.wire import Body
from nondum.transport.peers import CallFailed, IncomingCall

pytestmark = pytest.mark.anyio

ABLE = "I can follow you."


async def able(words: str) -> str | None:
    return ABLE if words.startswith("what can you do") else None


def asking(reach: OnePeer) -> Asking:
    return Asking(reach, lambda: ("mule", "big-mule"), able)


@pytest.mark.parametrize(
    ("words", "peer"),
    [("mule, what can you do?", "mule"), ("Big mule what can you do for me", "big-mule")],
)
async def test_question_goes_to_the_peer_that_it_names(words: str, peer: str) -> None:
    peers = OnePeer({METHOD: asking(OnePeer({})).serve})
    assert await asking(peers).ask(words) == f"{peer}: {ABLE}"


@pytest.mark.parametrize("words", ["what can you do", "mule, follow me", "scout, what can you do"])
async def test_other_words_are_asked_of_no_peer(words: str) -> None:
    assert await asking(OnePeer({})).ask(words) is None


async def test_older_peer_is_said_to_be_one() -> None:
    with pytest.raises(GoalRefused) as refused:
        await asking(OnePeer({})).ask("mule, what can you do")
    (problem,) = refused.value.problems
    assert problem.code == "METHOD_UNKNOWN"
    assert problem.message.startswith("mule ")
    assert problem.fix


async def test_peer_that_is_not_reached_is_told() -> None:
    def unreachable(_: IncomingCall) -> Body:
        raise HostUnreachable(Problem("PEER_GONE", "made up"))

    with pytest.raises(GoalRefused, match="PEER_GONE"):
        await asking(OnePeer({METHOD: unreachable})).ask("mule, what can you do")


async def test_what_a_peer_answers_is_bounded_and_plain() -> None:
    peers = OnePeer({METHOD: lambda _: {"answer": "\x1b[2J" + "x" * 5000}})
    told = await asking(peers).ask("mule, what can you do")
    assert told is not None
    assert "\x1b" not in told
    assert len(told) < MAX_WORDS + 100


async def test_answer_that_is_none_is_refused() -> None:
    with pytest.raises(GoalRefused, match="CALL_MALFORMED"):
        await asking(OnePeer({METHOD: lambda _: {"answer": 7}})).ask("mule, what can you do")


@pytest.mark.parametrize(
    "words",
    [7, None, "follow me", "what can you do " + "x" * MAX_WORDS],
    ids=["number", "none", "no question", "long"],
)
async def test_what_is_no_question_is_not_answered(words: Any) -> None:
    with pytest.raises(CallFailed, match="CALL_MALFORMED"):
        await asking(OnePeer({})).serve(incoming(METHOD, {"words": words}))
