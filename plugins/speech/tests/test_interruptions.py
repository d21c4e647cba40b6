"""The robot recognises interruptions through its own voice. The acoustics are simulated."""

from __future__ import annotations

import numpy as np
import pytest
from overhearing import START_S, overheard, pieces
from pywebrtc_audio import EchoCanceller
from recorded import OTHER, ROBOT, ROBOT_OF_STOPS, STOPPING, said

from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.interruptions import LONGEST, PAUSE, Interruptions
from nondum_speech.lexicon import lexicon
from nondum_speech.own_voice import OwnVoice, way_of
from nondum_speech.recogniser import FreeHearing, Recogniser
from nondum_speech.settings import Settings
from nondum_speech.sound import RATE_HZ, Sound

VOCABULARY = Vocabulary((*STOPPING, "follow me through the facility"), stops=STOPPING)
SILENCE = Sound(np.zeros(6 * RATE_HZ, np.int16))


@pytest.fixture(scope="module")
def recogniser(espeak: Espeak, free: FreeHearing) -> Recogniser:
    words = lexicon(VOCABULARY.words, lambda word, voice: espeak.phonemes(word, voice=voice))
    return Recogniser(VOCABULARY, words, free, Settings().limits)


def interruptions(own: Sound, heard: Sound) -> list[Sound]:
    """Those in what is heard, by a robot that has spoken before."""
    canceller, before = EchoCanceller(RATE_HZ), said(ROBOT)
    listening = Interruptions(OwnVoice(before, canceller))
    assert not [1 for piece in pieces(overheard(before)) for _ in listening.feed(piece)]
    listening = Interruptions(OwnVoice(own, canceller))
    return [other for piece in pieces(heard) for other in listening.feed(piece)]


def test_way_from_loudspeaker_to_microphone_is_found() -> None:
    own = said(ROBOT)
    heard = overheard(own).samples[:RATE_HZ]
    assert way_of(own.samples[:RATE_HZ], heard, RATE_HZ) == int(START_S * RATE_HZ)


@pytest.mark.parametrize("seconds", [0.6, 0.9, 1.2])
def test_voice_of_somebody_else_is_not_taken_for_the_own(seconds: float) -> None:
    length = int(seconds * RATE_HZ)
    assert way_of(said(ROBOT).samples[:length], said(OTHER).samples[:length], RATE_HZ) is None


def test_own_voice_is_taken_out_and_the_person_left() -> None:
    own, word = OwnVoice(said(ROBOT), EchoCanceller(RATE_HZ)), said("hold still")
    apart = [own.feed(piece) for piece in pieces(overheard(said(ROBOT), word))]
    heard, rest = (np.concatenate([getattr(one, of) for one in apart]) for of in ("heard", "rest"))
    alone = slice(RATE_HZ, 2 * RATE_HZ)
    there = slice(2 * RATE_HZ, 2 * RATE_HZ + len(word.samples))
    assert power(rest[alone]) < power(heard[alone]) / 30
    assert power(rest[there]) > power(word.samples) / 3


@pytest.mark.parametrize("own", [ROBOT, ROBOT_OF_STOPS])
def test_robot_does_not_interrupt_itself(own: str) -> None:
    assert not interruptions(said(own), overheard(said(own)))


@pytest.mark.parametrize("own", [ROBOT, ROBOT_OF_STOPS])
@pytest.mark.parametrize("word", STOPPING)
def test_stop_word_is_recognised_through_the_own_voice(
    word: str, own: str, recogniser: Recogniser
) -> None:
    found = interruptions(said(own), overheard(said(own), said(word)))
    assert [words for other in found if (words := recogniser.stop_in(other))] == [word]


def test_word_is_given_a_pause_after_it_ended() -> None:
    word, at_s = said("stop"), 2.0
    listening = Interruptions(OwnVoice(said(ROBOT), EchoCanceller(RATE_HZ)))
    ended = at_s + word.seconds
    for number, piece in enumerate(pieces(overheard(said(ROBOT), word, at_s=at_s))):
        if list(listening.feed(piece)):
            assert number / 50 < ended + PAUSE / 100 + 0.2
            return
    pytest.fail("it is not given")


def test_another_sentence_that_can_be_said_stops_nothing(recogniser: Recogniser) -> None:
    found = interruptions(said(ROBOT), overheard(said(ROBOT), said(OTHER)))
    assert found
    assert not any(map(recogniser.stop_in, found))


def test_person_is_recognised_where_the_own_voice_is_not(recogniser: Recogniser) -> None:
    samples = SILENCE.samples.copy()
    samples[3 * RATE_HZ : 3 * RATE_HZ + len(said("freeze").samples)] += said("freeze").samples
    (other,) = interruptions(said(ROBOT), Sound(samples))
    assert recogniser.stop_in(other) == "freeze"
    assert not interruptions(said(ROBOT), SILENCE)


def test_endless_hum_is_not_taken_for_a_person() -> None:
    length = LONGEST * RATE_HZ // 100
    hum = np.sin(np.arange(length + RATE_HZ) / 20) * 3000
    samples = np.pad(hum, (RATE_HZ, RATE_HZ)).astype(np.int16)
    assert not interruptions(said(ROBOT), Sound(samples))
    shorter = np.pad(hum[: length // 2], (3 * RATE_HZ, RATE_HZ)).astype(np.int16)
    assert len(interruptions(said(ROBOT), Sound(shorter))) == 1


def test_stop_is_not_recognised_where_no_stop_word_is_known(
    espeak: Espeak, free: FreeHearing
) -> None:
    vocabulary = Vocabulary(("search for people",))
    words = lexicon(vocabulary.words, lambda word, voice: espeak.phonemes(word, voice=voice))
    recogniser = Recogniser(vocabulary, words, free, Settings().limits)
    assert recogniser.stop_in(said("stop")) == ""


def power(samples: np.ndarray) -> float:
    return float(np.mean(samples.astype(np.float64) ** 2))
