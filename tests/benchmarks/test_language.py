"""The sentences of the language benchmark: enough, each once, of known goals, and split."""

from __future__ import annotations

from collections import Counter

import pytest
from benchmarks.language import corpus
from benchmarks.language.corpus import Sentence
from benchmarks.language.scoring import MISSED, RIGHT, WRONG, Score, judged, scored
from benchmarks.language.understanding import Declared, robot

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


class Fixed:
    """Answers each sentence with the same letters."""

    def __init__(self, letters: str) -> None:
        self.name, self._letters = letters, letters

    def meaning(self, sentence: str) -> str:
        return self._letters


@pytest.mark.parametrize(
    ("meant", "understood", "score"),
    [
        ("F", "F", RIGHT),
        ("F", "", MISSED),
        ("F", "P", WRONG),
        ("S|K", "K", RIGHT),
        ("F+W", "W+F", RIGHT),
        ("F>W", "W>F", WRONG),
        ("F+W", "F", WRONG),
        ("none", "", RIGHT),
        ("none", "F", WRONG),
        ("-F", "F", WRONG),
        ("-F", "", RIGHT),
        ("F?", "F", WRONG),
        ("halt", "", RIGHT),
        ("F", "?", WRONG),
    ],
)
def test_answers_are_judged_by_goals(meant: str, understood: str, score: Score) -> None:
    assert judged(meant, understood) == score
    assert scored(Fixed(understood), [Sentence("any", "any", meant)] * 2) == score + score


def test_declared_phrases_are_understood_and_no_goal_is_meant_that_is_not_listed() -> None:
    rung = Declared(robot())
    declared = [sentence for sentence in SENTENCES if sentence.group == "declared"]
    assert scored(rung, declared) == Score(right=len(declared))
    assert "?" not in {rung.meaning(sentence.text) for sentence in SENTENCES}
