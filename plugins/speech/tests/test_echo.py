"""The own voice is found in what is heard, and taken out of it."""

from __future__ import annotations

import numpy as np
import pytest
from overhearing import START_S, overheard, pieces, says

from nondum_speech.echo import EchoCanceller, way_of
from nondum_speech.espeak import Espeak
from nondum_speech.own_voice import EARLY, OwnVoice
from nondum_speech.sound import RATE_HZ, Sound


@pytest.fixture(scope="module")
def own(espeak: Espeak) -> Sound:
    return says(espeak)


def rest_of(said: Sound, heard: Sound, canceller: EchoCanceller) -> tuple[OwnVoice, np.ndarray]:
    voice = OwnVoice(said, canceller)
    return voice, np.concatenate([voice.heard(piece) for piece in pieces(heard)])


def decibels(one: np.ndarray, other: np.ndarray) -> float:
    return float(10 * np.log10(np.mean(one.astype(float) ** 2) / np.mean(other.astype(float) ** 2)))


def test_way_from_loudspeaker_to_microphone_is_found(own: Sound) -> None:
    heard = overheard(own).samples[:RATE_HZ]
    assert way_of(own.samples[:RATE_HZ], heard, RATE_HZ) == int(START_S * RATE_HZ)


def test_voice_of_somebody_else_is_not_taken_for_the_own(own: Sound, espeak: Espeak) -> None:
    text = "Please step back a little, and hold the door for everybody who comes after you."
    other = espeak.say(text, voice="en-gb-x-rp+f2", words_per_minute=150).samples
    for seconds in (0.6, 0.9, 1.5, 2.4):
        length = int(seconds * RATE_HZ)
        assert way_of(own.samples[:length], other[:length], RATE_HZ) is None


def test_own_voice_is_taken_out_and_what_was_learnt_is_kept(own: Sound) -> None:
    heard, canceller = overheard(own), EchoCanceller()
    first, _ = rest_of(own, heard, canceller)
    again, rest = rest_of(own, heard, canceller)
    end = len(own.samples)
    assert decibels(rest[:end], heard.samples[:end]) < -10
    assert first.is_taken_out and again.is_taken_out


def test_person_who_speaks_meanwhile_is_left(own: Sound, espeak: Espeak) -> None:
    canceller = EchoCanceller()
    rest_of(own, overheard(own), canceller)
    word = espeak.say("hold still", voice="en-gb-x-rp+f2", words_per_minute=160)
    _, rest = rest_of(own, overheard(own, word), canceller)
    there = slice(2 * RATE_HZ, 2 * RATE_HZ + len(word.samples))
    assert abs(decibels(rest[there], word.samples)) < 3


def test_what_is_heard_waits_until_the_own_voice_is_found_in_it(own: Sound) -> None:
    voice = OwnVoice(own, EchoCanceller())
    heard = list(pieces(overheard(own)))
    assert not len(np.concatenate([voice.heard(piece) for piece in heard[:5]]))
    assert len(np.concatenate([voice.heard(piece) for piece in heard[5:12]])) > RATE_HZ


def test_own_voice_that_is_not_heard_is_not_waited_for(own: Sound) -> None:
    hiss = np.random.default_rng(2).normal(0, 100, 3 * RATE_HZ).astype(np.int16)
    voice, rest = rest_of(own, Sound(hiss), EchoCanceller())
    assert not voice.is_audible
    assert np.allclose(rest, hiss[: len(rest)])


def test_what_was_said_is_known_for_each_moment_of_what_was_heard(own: Sound) -> None:
    voice, rest = rest_of(own, overheard(own), EchoCanceller())
    begin, end = RATE_HZ, RATE_HZ + 1000
    way = int(START_S * RATE_HZ)
    then = voice.said_in(begin, end).samples
    assert np.array_equal(then, own.samples[begin - way + EARLY : end - way + EARLY])
    assert len(voice.said_in(len(rest) - 100, len(rest) + 500).samples) < 500
