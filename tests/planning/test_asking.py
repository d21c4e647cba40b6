"""A robot knows when it is asked about itself, and takes nothing else for that."""

from __future__ import annotations

import pytest

from nondum.planning.words.asking import ASKED, Asked, Question, question_in
from nondum.planning.words.stop_words import is_stop


def test_what_listeners_are_told_to_hear_is_understood_and_stops_nothing() -> None:
    for question in Question:
        assert question_in(question.value) == Asked(question)
        assert not is_stop(question.value)
    assert set(ASKED) <= {question.value for question in Question}


@pytest.mark.parametrize(
    ("said", "question"),
    [
        ("What can you do?", Question.ABILITIES),
        ("please tell me what you can do", Question.ABILITIES),
        ("Hey robot, what can I say now", Question.ABILITIES),
        ("big mule, what can you do for me?", Question.ABILITIES),
        ("big-mule what are you up to", Question.ACTIVITY),
        ("what are you doing right now", Question.ACTIVITY),
        ("What's going on?", Question.ACTIVITY),
        ("But why not?", Question.WHY_NOT),
        ("what are you waiting for", Question.WHY_NOT),
        ("what just happened", Question.EVENTS),
        ("Robot, what's new?", Question.EVENTS),
        ("big mule, who are you", Question.HOSTS),
        ("who else is here right now", Question.HOSTS),
        ("Is it safe to pull this?", Question.PULLING),
        ("can I unplug the stick now, please", Question.PULLING),
    ],
)
def test_people_ask_in_many_ways(said: str, question: Question) -> None:
    assert question_in(said, "big-mule") == Asked(question)


@pytest.mark.parametrize(
    ("said", "about"),
    [
        ("why can't you follow me?", "follow me"),
        ("Big mule, why won't you point at the source", "point at the source"),
        ("so why don't you", ""),
        ("why can’t you?", ""),
    ],
)
def test_people_ask_why_a_wish_is_not_fulfilled(said: str, about: str) -> None:
    assert question_in(said, "big-mule") == Asked(Question.WHY_NOT, about)


@pytest.mark.parametrize(
    "said",
    [
        *("", "what", "tell me", "what can you see", "what are you doing to the people"),
        *("why", "why did you do that", "who is the person here", "can i pull your leg"),
        *("what happened to the lamp", "is it safe to walk here", "can i pull"),
        *("rover, what can you do", "do what you can do", "where are you", "follow me"),
    ],
)
def test_sentences_that_say_more_are_for_phrases(said: str) -> None:
    assert question_in(said, "big-mule") is None
