"""Acting hooks are asked of a component's worker; one that fails says why."""

from __future__ import annotations

import asyncio

import pytest
from tests.kit.workers import WorkersUnderTest

from nondum.sdk.description import Unit
from nondum.sdk.errors import NondumError

pytestmark = pytest.mark.anyio

HELLO = {"words": "hello", "vocabulary": {}}
TALKER = '''
"""Talks."""
from nondum.sdk import Unit, hookimpl

@hookimpl
def units():
    return (Unit("mouth", "speaker"),)

@hookimpl
async def translate_goal(ctx, words):
    return {"pddl": f"(said {words})"} if words != "boom" else 1 / 0
'''


async def talker(tested: WorkersUnderTest) -> None:
    await tested.start("talker", TALKER, units=(Unit("mouth", "speaker"),), summary="Talks.")


async def test_worker_answers_for_its_component(tested: WorkersUnderTest) -> None:
    await talker(tested)
    await tested.start("silent", "'''Says nothing.'''", summary="Says nothing.")
    asked = (tested.workers.ask(name, "translate_goal", HELLO) for name in ("talker", "silent"))
    assert await asyncio.gather(*asked) == [{"pddl": "(said hello)"}, {}]
    assert await tested.workers.ask("talker", "speak", {"text": "hi"}) == {}


async def test_failing_hook_says_why(tested: WorkersUnderTest) -> None:
    await talker(tested)
    body = {**HELLO, "words": "boom"}
    with pytest.raises(NondumError, match="division by zero"):
        await tested.workers.ask("talker", "translate_goal", body)


async def test_hook_of_a_worker_that_goes_comes_to_nothing(tested: WorkersUnderTest) -> None:
    await talker(tested)
    answer = asyncio.ensure_future(tested.workers.ask("talker", "translate_goal", HELLO))
    await asyncio.gather(tested.workers.stop("talker"), answer)
    assert await answer in (None, {"pddl": "(said hello)"})
    assert await tested.workers.ask("talker", "translate_goal", HELLO) is None


async def test_component_without_a_worker_comes_to_nothing(tested: WorkersUnderTest) -> None:
    assert await tested.workers.ask("nothing", "listen", {}) is None
