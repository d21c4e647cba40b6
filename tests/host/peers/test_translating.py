"""Words go to the translators of peers; their answers are bounded, and one that fails says why."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest
from tests.host.mind.robot import Robot
from tests.host.peers.one_peer import OnePeer, incoming
from tests.planning.strangers import SPEAKER

from nondum.host.mind.component_plugins import Ask, ComponentPlugins
from nondum.host.mind.planners import Planners
from nondum.host.mind.translation import LONGEST_WORDS, gathered
from nondum.host.peers.translating import METHOD, MOST_ANSWERS, Translating
from nondum.sdk.errors import HostUnreachable, NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.peers import CallFailed, IncomingCall

pytestmark = pytest.mark.anyio

VOCABULARY = {"host": "rover", "sentences": ["follow me"]}


async def meant(component: str, hook: str, body: Mapping[str, Any]) -> Mapping[str, Any] | None:
    assert body["vocabulary"] == VOCABULARY
    return {"words": "follow me"} if body["words"] == "come along" else None


async def broken(component: str, hook: str, body: Mapping[str, Any]) -> Mapping[str, Any] | None:
    raise NondumError(Problem("ENDPOINT_SILENT", "the server says nothing"))


def node(ask: Ask) -> Translating:
    """A host whose one component translates."""
    robot = Robot(Planners([]))
    robot.plug(SPEAKER)
    robot.mind.plugins = ComponentPlugins(ask)
    robot.mind.plugins.see(robot.mind.beliefs.snapshot)
    return Translating(lambda: robot.mind, OnePeer({}), lambda: (), deadline_s=60)


def rover(serve: Any) -> Translating:
    """A host beside a peer that answers so."""
    serves = {} if serve is None else {METHOD: serve}
    return Translating(
        lambda: Robot(Planners([])).mind, OnePeer(serves), lambda: ("mule",), deadline_s=60
    )


async def told(serve: Any, words: str = "come along") -> tuple[Mapping[str, Any], list[str]]:
    answers, problems = await gathered(rover(serve).ask(words, VOCABULARY), 60)
    return answers, [problem.code for problem in problems]


async def test_component_of_a_peer_translates() -> None:
    assert await told(node(meant).serve) == ({"speaker@mule": {"words": "follow me"}}, [])
    assert await told(node(meant).serve, "mumble") == ({}, [])


async def test_failure_of_all_translators_of_a_peer_is_told() -> None:
    answers, problems = await gathered(rover(node(broken).serve).ask("hi", VOCABULARY), 60)
    assert not answers
    (problem,) = problems
    assert (problem.code, problem.where) == ("TRANSLATION_FAILED", "speaker@mule")
    assert "ENDPOINT_SILENT" in problem.message


async def test_peer_that_goes_in_the_middle_is_told() -> None:
    def gone(_: IncomingCall) -> Body:
        raise HostUnreachable(Problem("PEER_GONE", "made up"))

    assert await told(gone) == ({}, ["TRANSLATION_FAILED"])


async def test_older_peer_translates_nothing() -> None:
    assert await told(None) == ({}, [])


@pytest.mark.parametrize(
    "answers",
    [
        pytest.param(None, id="none"),
        pytest.param(["follow me"], id="list"),
        pytest.param({"model": "follow me"}, id="text"),
        pytest.param({7: {"words": "follow me"}}, id="number"),
        pytest.param({str(n): {} for n in range(MOST_ANSWERS + 1)}, id="many"),
    ],
)
async def test_what_is_no_answer_is_refused(answers: Any) -> None:
    assert await told(lambda _: {"answers": answers}) == ({}, ["TRANSLATION_FAILED"])


async def test_name_of_a_peers_component_is_printable() -> None:
    answers, _ = await told(lambda _: {"answers": {"\x1b[2J": {"words": "follow me"}}})
    assert "\x1b" not in "".join(answers)


@pytest.mark.parametrize(
    "args",
    [
        pytest.param({}, id="nothing"),
        pytest.param({"words": "hi"}, id="no vocabulary"),
        pytest.param({"words": 7, "vocabulary": {}}, id="number"),
        pytest.param({"words": "", "vocabulary": {}}, id="empty"),
        pytest.param({"words": "x" * (LONGEST_WORDS + 1), "vocabulary": {}}, id="long"),
        pytest.param({"words": "hi", "vocabulary": []}, id="list"),
    ],
)
async def test_what_cannot_be_translated_is_refused(args: dict[str, Any]) -> None:
    with pytest.raises(CallFailed, match="CALL_MALFORMED"):
        await node(meant).serve(incoming(METHOD, args))


async def test_one_sentence_of_a_peer_is_translated_at_a_time() -> None:
    async def asks_again(component: str, hook: str, body: Mapping[str, Any]) -> None:
        if body["words"] == "first":
            again = dict(body) | {"words": "second"}
            with pytest.raises(CallFailed, match="PEER_BUSY"):
                await busy.serve(incoming(METHOD, again))

    busy = node(asks_again)
    for words in ("first", "second"):
        body = {"words": words, "vocabulary": VOCABULARY}
        assert await busy.serve(incoming(METHOD, body)) == {"answers": {}}
