"""A recogniser in a separate process."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest
from overhearing import overheard, pieces
from recorded import ROBOT
from recorded import said as recorded

from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import Lexicon, lexicon
from nondum_speech.recogniser import NOTHING
from nondum_speech.recognising import RecogniserEnded, Recognising
from nondum_speech.settings import Settings
from nondum_speech.sound import Sound

VOCABULARY = Vocabulary(
    ("follow {class}", "search for {class}", "hold still"),
    {"class": ("me", "people")},
    ("hold still",),
)


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


def test_sentence_is_recognised_only_after_a_vocabulary_was_learnt(
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


def test_stop_word_is_recognised_while_the_robot_speaks_and_learns(
    words: Lexicon,
) -> None:
    own, word = recorded(ROBOT), recorded("hold still")

    async def hear() -> list[str]:
        async with recognising() as one:
            await one.says(own)
            assert not await one.stop_in(word)
            await one.learn(VOCABULARY, words)
            found = []
            for sound in (overheard(own), overheard(own, word)):
                await one.says(own)
                found += [await one.stop_in(piece) for piece in list(pieces(sound))[:15]]
                await one.learn(replace(VOCABULARY, phrases=("follow me", "hold still")), words)
                found += [await one.stop_in(piece) for piece in list(pieces(sound))[15:]]
            return [heard for heard in found if heard]

    assert asyncio.run(hear()) == ["hold still"]


def test_process_that_was_killed_while_the_robot_speaks_hears_again_with_its_next_sentence(
    words: Lexicon,
) -> None:
    own = recorded(ROBOT)

    async def hear() -> None:
        async with recognising() as one:
            await one.learn(VOCABULARY, words)
            await one.says(own)
            assert one.pid is not None
            os.kill(one.pid, signal.SIGKILL)
            with pytest.raises(RecogniserEnded):
                await one.stop_in(own)
            assert await one.stop_in(own) == ""
            await one.says(own)
            assert await one.stop_in(own) == ""

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


def test_answer_to_a_cancelled_request_is_not_given_to_the_next(
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
