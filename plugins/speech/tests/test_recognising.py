"""A recogniser in a process of its own."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import Lexicon, lexicon
from nondum_speech.recogniser import NOTHING
from nondum_speech.recognising import RecogniserEnded, Recognising
from nondum_speech.settings import Settings
from nondum_speech.sound import Sound

VOCABULARY = Vocabulary(("follow {class}", "search for {class}"), {"class": ("me", "people")})


@pytest.fixture(scope="module")
def words(espeak: Espeak) -> Lexicon:
    return lexicon(VOCABULARY.words, lambda word, voice: espeak.phonemes(word, voice=voice))


@asynccontextmanager
async def recognising() -> AsyncIterator[Recognising]:
    one = Recognising(Settings().limits)
    yield one
    await one.close()
    assert one.pid is None


def said(espeak: Espeak, text: str) -> Sound:
    return espeak.say(text, voice="en-us", words_per_minute=140)


def test_sentence_is_heard_and_nothing_before_anything_was_learnt(
    espeak: Espeak, words: Lexicon
) -> None:
    async def hear() -> None:
        async with recognising() as one:
            assert await one.hear(said(espeak, "follow me")) == NOTHING
            assert one.pid is None
            await one.learn(VOCABULARY, words)
            assert one.pid not in (None, os.getpid())
            assert (await one.hear(said(espeak, "follow me"))).said == "follow me"

    asyncio.run(hear())


def test_process_that_was_killed_is_started_again_and_knows_the_words(
    espeak: Espeak, words: Lexicon
) -> None:
    async def hear() -> None:
        async with recognising() as one:
            await one.learn(VOCABULARY, words)
            assert one.pid is not None
            os.kill(one.pid, signal.SIGKILL)
            with pytest.raises(RecogniserEnded):
                await one.hear(said(espeak, "follow me"))
            assert (await one.hear(said(espeak, "follow me"))).said == "follow me"

    asyncio.run(hear())


def test_answer_that_nobody_waits_for_any_more_is_not_the_next_ones(
    espeak: Espeak, words: Lexicon
) -> None:
    async def hear() -> None:
        async with recognising() as one:
            await one.learn(VOCABULARY, words)
            cancelled = asyncio.create_task(one.hear(said(espeak, "search for people")))
            await asyncio.sleep(0)
            cancelled.cancel()
            assert (await one.hear(said(espeak, "follow me"))).said == "follow me"
            await one.learn(Vocabulary(("search for people",)), words)
            assert (await one.hear(said(espeak, "search for people"))).said == "search for people"

    asyncio.run(hear())
