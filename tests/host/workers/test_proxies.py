"""The host's pluggy manager knows running plugins by proxies that answer and never raise."""

from __future__ import annotations

import asyncio

import pytest
from tests.kit.workers import WorkersUnderTest

from nondum.sdk.description import Unit

pytestmark = pytest.mark.anyio

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


async def test_describing_hooks_answer_at_once(tested: WorkersUnderTest) -> None:
    await talker(tested)
    await tested.start("quiet", "'''Says nothing.'''", summary="Says nothing.")
    summaries = {answer["summary"] for answer in tested.workers.hook.describe()}
    assert summaries == {"Talks.", "Says nothing."}
    assert (Unit("mouth", "speaker"),) in tested.workers.hook.units()
    for name in ("behaviours", "conditions", "fragments", "devices", "phrases", "labels"):
        assert getattr(tested.workers.hook, name)() == [(), ()]


async def test_acting_hooks_are_gathered(tested: WorkersUnderTest) -> None:
    await talker(tested)
    await tested.start("quiet", "'''Says nothing.'''", summary="Says nothing.")
    answers = await asyncio.gather(
        *tested.workers.hook.translate_goal(ctx=None, words="hello", vocabulary={})
    )
    assert sorted(answers, key=str) == [{"pddl": "(said hello)"}, {}]
    assert await asyncio.gather(*tested.workers.hook.speak(ctx=None, text="hi")) == [{}, {}]


async def test_every_component_is_asked_to_translate(tested: WorkersUnderTest) -> None:
    await talker(tested)
    await tested.start("quiet", "'''Says nothing.'''", summary="Says nothing.")
    asked = tested.workers.translations("hello", {"host": "rover"})
    answers = dict(zip(asked, await asyncio.gather(*asked.values()), strict=True))
    assert answers == {"talker": {"pddl": "(said hello)"}, "quiet": {}}


async def test_failing_hook_comes_to_nothing(tested: WorkersUnderTest) -> None:
    await talker(tested)
    (answer,) = tested.workers.hook.translate_goal(ctx=None, words="boom", vocabulary={})
    assert await answer is None


async def test_hook_of_a_worker_that_goes_comes_to_nothing(tested: WorkersUnderTest) -> None:
    await talker(tested)
    (answer,) = tested.workers.hook.translate_goal(ctx=None, words="hello", vocabulary={})
    await tested.workers.stop("talker")
    assert await answer is None


async def test_proxy_goes_with_its_worker(tested: WorkersUnderTest) -> None:
    await talker(tested)
    await tested.workers.stop("talker")
    assert tested.workers.hook.describe() == []
