"""Sentences that are nearly a phrase are found, to be asked back; those that turn it are not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.planning.speaking import BASE, COMPTON, POINTER, asked, book
from tests.planning.strangers import PEOPLE_DETECTOR

from nondum.planning.words.courtesies import without_courtesies
from nondum.planning.words.near import FURTHEST, edits, nearest
from nondum.planning.words.pattern import words_of
from nondum.sdk.description import Label, Phrase
from nondum.sdk.errors import GoalRefused

DETECTOR = replace(
    PEOPLE_DETECTOR,
    labels=tuple(Label("person", words) for words in ("me", "people", "a person")),
)
BOOK = book(BASE, DETECTOR, POINTER, COMPTON)
FOLLOWED = ("maintain", "(following rover person)")
POINTED = ("maintain", "(pointing rover radiation-source)")


def only(sentence: str) -> tuple[str, str]:
    (near,) = nearest(BOOK, sentence)
    return asked(near.reading.goal)


@pytest.mark.parametrize(
    "sentence",
    [
        "please follow me",
        "Robot, could you follow me now, please?",
        "I'd like you to follow people",
        "hey, can you please follow a person for me",
        "follow me through the facility, please",
    ],
)
def test_courtesies_around_a_phrase_change_nothing(sentence: str) -> None:
    (near,) = nearest(BOOK, sentence)
    assert asked(near.reading.goal) == FOLLOWED
    assert near.distance == 0


@pytest.mark.parametrize(
    ("sentence", "goal"),
    [
        ("fllow me", FOLLOWED),
        ("folow people", FOLLOWED),
        ("follow poeple", FOLLOWED),
        ("please folllow me", FOLLOWED),
        ("follow a purse on", FOLLOWED),
        ("followme", FOLLOWED),
        ("point of the radiation source", POINTED),
        ("pointed the radiation source", POINTED),
        ("point at the radition sorce", POINTED),
    ],
)
def test_slips_and_words_misheard_are_near(sentence: str, goal: tuple[str, str]) -> None:
    assert only(sentence) == goal


@pytest.mark.parametrize(
    "sentence",
    [
        *("don't follow me", "do not follow me", "never follow me", "stop follow me"),
        *("follow me not", "follow me or point", "follow me until noon", "if follow me"),
        *("follow us", "follow it", "follow him", "point at her radiation source"),
        *("follow me through the door and wait there", "follow me through the hall until noon"),
    ],
)
def test_what_turns_a_wish_is_never_near(sentence: str) -> None:
    assert nearest(BOOK, sentence) == ()
    with pytest.raises(GoalRefused):
        BOOK.goal(sentence)


@pytest.mark.parametrize(
    "sentence",
    ["", "me", "please", "follow", "go to the kitchen", "point at the door", "follow me slowly"],
)
def test_what_is_far_is_not_near(sentence: str) -> None:
    assert nearest(BOOK, sentence) == ()


def test_all_are_given_where_it_is_not_clear_which_is_meant() -> None:
    phrases = (*BASE.phrases, Phrase("hollow {c:class}", "(found ?c self)"))
    one = book(replace(BASE, phrases=phrases), DETECTOR)
    assert {near.words for near in nearest(one, "gollow me")} == {"follow me", "hollow me"}


def test_nearest_comes_first_and_one_that_is_clearly_nearer_comes_alone() -> None:
    assert [near.words for near in nearest(BOOK, "follow poeple")] == ["follow people"]


def test_nothing_is_near_where_nothing_can_be_said() -> None:
    assert nearest(book(COMPTON), "follow me") == ()


LETTERS = st.text("abcdefghij ", max_size=3)


@given(st.integers(0, 12), LETTERS)
def test_one_slip_in_a_phrase_is_found(place: int, letter: str) -> None:
    said = "follow people"
    slipped = said[:place] + letter[:1] + said[place + 1 :]
    found = nearest(BOOK, slipped)
    assert [asked(near.reading.goal) for near in found] == [FOLLOWED]


@given(
    st.text(max_size=80)
    | st.lists(st.sampled_from(words_of("follow me not point at"))).map(" ".join)
)
def test_what_is_found_is_no_further_than_it_may_be(sentence: str) -> None:
    found = nearest(BOOK, sentence)
    assert all(near.distance <= FURTHEST for near in found)
    assert list(found) == sorted(found, key=lambda near: near.distance)


@given(st.text("abc", max_size=7), st.text("abc", max_size=7), st.integers(0, 7))
def test_edits_are_the_restricted_distance_of_damerau_and_levenshtein(
    one: str, other: str, most: int
) -> None:
    wanted = distance(one, other)
    found = edits(one, other, most)
    assert found == wanted if wanted <= most else found > most


@cache
def distance(one: str, other: str) -> int:
    """By its definition."""
    if not one or not other:
        return len(one) + len(other)
    ways = [
        distance(one[:-1], other) + 1,
        distance(one, other[:-1]) + 1,
        distance(one[:-1], other[:-1]) + (one[-1] != other[-1]),
    ]
    if one[-2:] == other[-2:][::-1] and len(one) > 1 and len(other) > 1:
        ways.append(distance(one[:-2], other[:-2]) + 1)
    return min(ways)


@pytest.mark.parametrize("sentence", ["please", "please please", "could you", "now now now"])
def test_a_sentence_of_nothing_but_courtesies_stays_one(sentence: str) -> None:
    assert without_courtesies(words_of(sentence))


@pytest.mark.parametrize(
    "sentence",
    ["don\u2019t follow me", "dont follow me", "follow me through the hall, don\u2019t run"],
)
def test_negations_are_seen_however_they_are_written(sentence: str) -> None:
    assert nearest(BOOK, sentence) == ()
    with pytest.raises(GoalRefused) as refused:
        BOOK.goal(sentence)
    assert "is in it" in refused.value.problems[0].fix


@pytest.mark.parametrize(
    ("phrase", "said"),
    [
        ("go to the great dock 1", "go to the great dock 2"),
        ("switch the great lamp on", "switch the great lamp off"),
        ("activate the great pump", "deactivate the great pump"),
        ("increase the pressure", "decrease the pressure"),
        ("unlock the great door", "lock the great door"),
        ("drive to the north end", "drive to the south end"),
    ],
)
def test_numbers_and_opposites_are_no_slips(phrase: str, said: str) -> None:
    one = book(replace(BASE, phrases=(Phrase(phrase, "(following self person)"),)), DETECTOR)
    assert nearest(one, phrase.replace("the great", "the graet"))
    assert nearest(one, said) == ()


def test_longest_sentences_are_not_looked_at() -> None:
    assert nearest(BOOK, "please " * 100_000) == ()
