"""Words that stop are heard while the robot speaks, and none in what it says itself."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator

import numpy as np
import pytest
from overhearing import OWN, overheard, pieces, says

from nondum_speech.ears import Ears
from nondum_speech.echo import EchoCanceller
from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import Lexicon, lexicon
from nondum_speech.recogniser import FreeHearing, Recogniser
from nondum_speech.settings import Settings
from nondum_speech.sound import Sound
from nondum_speech.spotting import StopSpotter, stop_phrases

STOPS = (
    "[please] stop [now]",
    "[please] freeze [now]",
    "[please] hold still [now]",
    "[please] дом",
)
VOCABULARY = Vocabulary((*STOPS[:3], "follow me", "search for people"), {}, STOPS)


@pytest.fixture(scope="module")
def words(espeak: Espeak) -> Lexicon:
    return lexicon(VOCABULARY.words, lambda word, voice: espeak.phonemes(word, voice=voice))


@pytest.fixture(scope="module")
def own(espeak: Espeak) -> Sound:
    """What the robot says; each time that it is made, it is a little different."""
    return says(espeak)


@pytest.fixture
def fresh(words: Lexicon, free: FreeHearing) -> StopSpotter:
    """One that never heard the robot's voice."""
    nearest = Recogniser(VOCABULARY, words, free, Settings().limits).nearest
    return StopSpotter(VOCABULARY, words, EchoCanceller(), nearest)


@pytest.fixture
def spotter(fresh: StopSpotter, own: Sound) -> StopSpotter:
    """One that heard the robot say something before."""
    assert not heard_by(fresh, own, overheard(own))
    return fresh


def heard_by(spotter: StopSpotter, own: Sound, heard: Sound) -> list[str]:
    spotter.begin(own)
    return [words for piece in pieces(heard) if (words := spotter.heard(piece))]


def said(espeak: Espeak, text: str) -> Sound:
    return espeak.say(text, voice="en-us+f2", words_per_minute=150)


def test_only_what_can_be_pronounced_is_spotted(words: Lexicon) -> None:
    found = stop_phrases(VOCABULARY, words)
    assert [*found] == ["stop", "freeze", "hold still"]
    assert "please hold still now" in found["hold still"]


@pytest.mark.parametrize("text", ["stop", "freeze", "hold still"])
def test_word_that_stops_is_heard_over_the_own_voice(
    espeak: Espeak, spotter: StopSpotter, own: Sound, text: str
) -> None:
    assert heard_by(spotter, own, overheard(own, said(espeak, text))) == [text]


@pytest.mark.parametrize("text", ["step back a little", "search for people"])
def test_other_words_do_not_stop_the_robot(
    espeak: Espeak, spotter: StopSpotter, own: Sound, text: str
) -> None:
    assert not heard_by(spotter, own, overheard(own, said(espeak, text)))


@pytest.mark.parametrize("text", ["Stop.", "Hold still!", "The stop key is not there. I freeze."])
def test_robot_does_not_stop_itself(espeak: Espeak, spotter: StopSpotter, text: str) -> None:
    own = says(espeak, f"{OWN} {text}")
    assert not heard_by(spotter, own, overheard(own))


def test_own_voice_that_was_never_heard_before_is_not_taken_for_a_persons(
    espeak: Espeak, fresh: StopSpotter
) -> None:
    own = says(espeak, "Stop! Hold still! Freeze!")
    assert not heard_by(fresh, own, overheard(own))


def test_nothing_is_heard_while_nothing_is_said(
    espeak: Espeak, spotter: StopSpotter, own: Sound
) -> None:
    word = said(espeak, "hold still")
    assert heard_by(spotter, own, overheard(own, word))
    assert not spotter.heard(word)


@pytest.mark.parametrize("listens_on", [True, False], ids=["on", "off"])
def test_ears_hear_it_while_the_robot_speaks_and_sentences_after(
    espeak: Espeak, own: Sound, listens_on: bool
) -> None:
    async def hear() -> list[str]:
        log = logging.getLogger("ears")
        ears = Ears(espeak, log, Settings().limits, listens_on=listens_on)
        await ears.learn(VOCABULARY)
        with ears.saying(own):
            await ears.attend(flow(overheard(own)))
        with ears.saying(own):
            await ears.attend(flow(overheard(own, said(espeak, "hold still"))))
        quiet = np.zeros(16_000, np.int16)
        await ears.attend(
            flow(Sound(np.concatenate([quiet, said(espeak, "follow me").samples, quiet])))
        )
        await ears.close()
        return [ears.sentences.get_nowait() for _ in range(ears.sentences.qsize())]

    assert asyncio.run(hear()) == [*(["hold still"] if listens_on else []), "follow me"]


async def flow(sound: Sound) -> AsyncIterator[bytes]:
    for piece in pieces(sound):
        yield piece.to_bytes()
