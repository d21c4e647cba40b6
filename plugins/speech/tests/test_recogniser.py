"""Synthesised voices say sentences, and the real recogniser tells which of them can be said."""

from __future__ import annotations

import numpy as np
import pytest

from nondum_speech.espeak import Espeak
from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import cmu_dictionary, lexicon
from nondum_speech.recogniser import FreeHearing, Limits, Recogniser, Recognition
from nondum_speech.sentences import Sentences, sentences_of
from nondum_speech.sound import RATE_HZ, Sound

SAID = (
    ("search for people", "en-us", 160),
    ("please follow people", "en-us+f2", 140),
    ("follow quadrotors", "en-us", 150),
    ("point at the radiation source", "en-gb-x-rp", 160),
    ("please locate the radiation source", "en-us+m3", 180),
    ("locate the zorgon", "en-us", 150),
)
FRAME = 480
"""Samples that are looked at for a voice at a time: 30 ms."""


def noise(seconds: float, rms: float) -> Sound:
    samples = np.random.default_rng(3).normal(0.0, rms, int(seconds * RATE_HZ))
    return Sound(samples.astype(np.int16))


@pytest.mark.parametrize(("text", "voice", "speed"), SAID, ids=lambda value: str(value))
def test_phrase_is_recognised_from_many_voices(
    espeak: Espeak, recogniser: Recogniser, text: str, voice: str, speed: int
) -> None:
    heard = recogniser.hear(espeak.say(text, voice=voice, words_per_minute=speed))
    assert heard.said == text


@pytest.mark.parametrize(
    "text",
    [
        "good morning everyone",
        "the weather will be fine tomorrow",
        "please sit down",
        "search the room",
        "point at",
        "people",
        "turn left at the corner",
    ],
)
def test_sentence_that_is_no_phrase_is_refused(
    espeak: Espeak, recogniser: Recogniser, text: str
) -> None:
    assert not recogniser.hear(espeak.say(text, voice="en-us", words_per_minute=160)).said


@pytest.mark.parametrize(
    "sound",
    [noise(2.0, 2000.0), noise(1.0, 10.0), Sound(np.zeros(16_000, np.int16)), noise(0.0, 1.0)],
    ids=["noise", "hiss", "silence", "nothing"],
)
def test_no_speech_is_no_sentence(recogniser: Recogniser, sound: Sound) -> None:
    assert not recogniser.hear(sound).said


def test_phrase_is_recognised_through_noise(espeak: Espeak, recogniser: Recogniser) -> None:
    said = espeak.say("search for people", voice="en-us", words_per_minute=160)
    hiss = noise(said.seconds, 0.1 * float(np.std(said.samples))).samples
    assert (
        recogniser.hear(Sound(said.samples + hiss[: len(said.samples)])).said == "search for people"
    )


def test_free_words_are_words_of_the_dictionary(espeak: Espeak, recogniser: Recogniser) -> None:
    words = recogniser.hear(said(espeak, "follow people through the old building")).said.split()
    assert words[:3] == ["follow", "people", "through"]
    assert "old" in words[3:]
    assert cmu_dictionary().keys() >= set(words)


def test_same_sound_gives_the_same_recognition(espeak: Espeak, recogniser: Recogniser) -> None:
    said = espeak.say("follow people", voice="en-us", words_per_minute=160)
    assert recogniser.hear(said) == recogniser.hear(said)


def test_new_words_are_recognised_after_they_are_learnt(espeak: Espeak, free: FreeHearing) -> None:
    vocabulary = Vocabulary(("switch off the lamp", "open the gate"))
    words = lexicon(vocabulary.words, lambda word, voice: espeak.phonemes(word, voice=voice))
    others = Recogniser(vocabulary, words, free, Limits(-0.85, -0.85))
    assert others.hear(said(espeak, "open the gate")).said == "open the gate"
    assert not others.hear(said(espeak, "search for people")).said


def test_words_that_stop_need_less_confidence(espeak: Espeak, free: FreeHearing) -> None:
    def hold_still(stops: tuple[str, ...]) -> Recognition:
        vocabulary = Vocabulary(("[please] hold still [now]", "open the gate"), {}, stops)
        words = lexicon(vocabulary.words, lambda word, voice: espeak.phonemes(word, voice=voice))
        strict = Recogniser(vocabulary, words, free, Limits(0.0, -9.0))
        return strict.hear(said(espeak, "please hold still"))

    without, with_stop = hold_still(()), hold_still(("[please] hold still [now]",))
    assert without.words == with_stop.words == "please hold still"
    assert not without.said
    assert with_stop.said


@pytest.mark.parametrize("text", ["rover stop", "stop rover", "please halt rover now"])
def test_stop_is_recognised_with_a_name_before_it_and_behind_and_without(
    espeak: Espeak, free: FreeHearing, text: str
) -> None:
    stops = tuple(
        pattern
        for word in ("stop", "halt")
        for pattern in (
            f"[{{addressee}}] [please] {word} [now]",
            f"[please] {word} {{addressee}} [now]",
        )
    )
    vocabulary = Vocabulary((*stops, "open the gate"), {"addressee": ("rover",)}, stops)
    words = lexicon(vocabulary.words, lambda word, voice: espeak.phonemes(word, voice=voice))
    recogniser = Recogniser(vocabulary, words, free, Limits(1.0, -9.0))
    sound = said(espeak, text)
    assert recogniser.hear(sound).said == text
    assert recogniser.stop_in(sound) == text
    assert recogniser.stop_in(said(espeak, "stop")).startswith("stop")


def test_word_that_is_said_in_noise_ends(espeak: Espeak) -> None:
    word = said(espeak, "halt").samples
    hiss = noise(4.0, 0.3 * float(np.std(word))).samples
    hiss[RATE_HZ : RATE_HZ + len(word)] += word
    cutter = Sentences()
    (sentence,) = cutter.feed(Sound(hiss).to_bytes())
    assert len(word) * 0.8 < len(sentence.samples) < len(word) + RATE_HZ


def test_nothing_is_recognised_with_an_empty_vocabulary(espeak: Espeak, free: FreeHearing) -> None:
    mute = Recogniser(Vocabulary(), lexicon((), lambda word, voice: ""), free, Limits(-9.0, -9.0))
    assert not mute.hear(said(espeak, "follow people")).words


def test_pauses_part_sentences(espeak: Espeak, recogniser: Recogniser) -> None:
    pause = np.zeros(2 * RATE_HZ, np.int16)
    texts = ("follow people", "point at the radiation source")
    pieces = [piece for text in texts for piece in (said(espeak, text).samples, pause)]
    sentences = sentences_of(Sound(np.concatenate([pause, *pieces])))
    assert [recogniser.hear(sentence).said for sentence in sentences] == list(texts)


def test_endless_humming_is_cut_off(espeak: Espeak) -> None:
    many = np.concatenate([said(espeak, "follow people everywhere").samples] * 30)
    assert all(sentence.seconds < 13 for sentence in sentences_of(Sound(many)))


@pytest.mark.parametrize("samples", [0, 1, FRAME, FRAME + 1, 50 * FRAME])
def test_silence_of_any_length_has_no_sentences(samples: int) -> None:
    assert sentences_of(Sound(np.zeros(samples, np.int16))) == ()


def test_a_sentence_that_ends_with_a_frame_is_recognised(
    espeak: Espeak, recogniser: Recogniser
) -> None:
    samples = said(espeak, "follow people").samples
    whole = np.pad(samples, (0, -len(samples) % FRAME))
    assert [recogniser.hear(sentence).said for sentence in sentences_of(Sound(whole))] == [
        "follow people"
    ]


def said(espeak: Espeak, text: str) -> Sound:
    return espeak.say(text, voice="en-us", words_per_minute=160)
