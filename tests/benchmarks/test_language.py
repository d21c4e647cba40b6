"""The sentences of the language benchmark: enough, each once, of known goals, and split for good."""

from __future__ import annotations

from collections import Counter

import pytest
from benchmarks.language import corpus
from benchmarks.language.corpus import Sentence

SENTENCES = corpus.sentences()


def test_there_are_enough_and_each_stands_once() -> None:
    assert len(SENTENCES) >= 300
    assert max(Counter(sentence.text.casefold() for sentence in SENTENCES).values()) == 1


@pytest.mark.parametrize("letter", corpus.goals())
def test_each_goal_is_asked_for_in_both_halves(letter: str) -> None:
    halves = {sentence.is_kept for sentence in SENTENCES if letter in sentence.goals}
    assert halves == {True, False}


def test_no_sentence_means_a_goal_that_is_not_listed() -> None:
    meant = {letter for sentence in SENTENCES for letter in sentence.goals}
    assert meant == corpus.goals().keys()


def test_each_group_is_in_both_halves() -> None:
    groups = {sentence.group for sentence in SENTENCES}
    for kept in (True, False):
        assert {s.group for s in SENTENCES if s.is_kept is kept} == groups


def test_a_sentence_stays_in_its_half() -> None:
    assert Sentence("follow me", "declared", "F").is_kept
    assert not Sentence("follow people", "declared", "F").is_kept
