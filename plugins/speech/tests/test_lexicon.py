"""How words are pronounced, those of no dictionary too."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from nondum_speech.arpabet import arpabet
from nondum_speech.espeak import Espeak
from nondum_speech.grammar import PHONES
from nondum_speech.lexicon import ACCENTS, Lexicon, cmu_dictionary, lexicon


@pytest.fixture
def look_up(espeak: Espeak) -> Callable[..., Lexicon]:
    """Looks words up."""

    def found(*words: str) -> Lexicon:
        return lexicon(words, lambda word, voice: espeak.phonemes(word, voice=voice))

    return found


def test_dictionary_comes_before_accents(look_up: Callable[..., Lexicon]) -> None:
    source = look_up("source").pronunciations["source"]
    assert source[0] == "S AO R S"
    assert "S AO S" in source[1:], "as in London"


def test_unknown_word_is_pronounced_by_rule_and_told(look_up: Callable[..., Lexicon]) -> None:
    found = look_up("people", "quadrotor", "café", "2")
    assert found.guessed == ("quadrotor", "café", "2")
    assert found.pronunciations["quadrotor"][0] == "K W AA D R OW D ER"
    assert found.pronunciations["2"] == ("T UW",)


def test_word_of_other_letters_is_told_to_be_unsayable(look_up: Callable[..., Lexicon]) -> None:
    found = look_up("дом", "people")
    assert found.unsayable == ("дом",)
    assert "дом" not in found.to_dictionary()


def test_variants_stand_under_each_other(look_up: Callable[..., Lexicon]) -> None:
    lines = look_up("the").to_dictionary().splitlines()
    assert lines[:2] == ["the DH AH", "the(2) DH IY"]


@pytest.mark.parametrize("accent", ACCENTS)
def test_every_phoneme_of_an_accent_is_understood(espeak: Espeak, accent: str) -> None:
    """Some hundred words have all sounds of English in them."""
    words = [word for word in list(cmu_dictionary())[::250] if word.isalpha()]
    for word in words:
        phones = arpabet(espeak.phonemes(word, voice=accent))
        assert phones is not None, (word, espeak.phonemes(word, voice=accent))
        assert set(phones.split()) <= set(PHONES)


def test_sounds_of_other_languages_are_not_guessed() -> None:
    assert arpabet("ʁ_a") is None
    assert arpabet("") is None
