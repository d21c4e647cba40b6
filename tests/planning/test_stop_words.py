"""A robot stops at a word, and at no sentence that says something else."""

from __future__ import annotations

import pytest

from nondum.planning.stop_words import STOPS, is_stop, is_stop_for_other


@pytest.mark.parametrize("said", STOPS)
def test_what_listeners_are_told_to_hear_stops(said: str) -> None:
    assert is_stop(said)


@pytest.mark.parametrize(
    "said",
    [
        *("STOP", "stop!", "stop stop stop", "please stop now", "robot, halt", "Do not move!"),
        *("stop it right now, please", "emergency stop", "stop moving", "whoa, stop everything"),
    ],
)
def test_people_say_it_in_many_ways(said: str) -> None:
    assert is_stop(said)


@pytest.mark.parametrize(
    "said",
    [
        *("", "please", "right now", "stop following me", "stop at the door", "don't stop"),
        *("bus stop", "never stop", "halt the people", "stopp", "full stop"),
    ],
)
def test_sentences_that_say_more_are_for_phrases(said: str) -> None:
    assert not is_stop(said)


@pytest.mark.parametrize(
    "said",
    [
        *("Rover, stop!", "rover please stop now", "hey big mule, halt", "the rover, don't move"),
        *("big-mule, stop it", "no-one-i-know freeze", "rover stop stop stop"),
    ],
)
def test_a_name_may_come_first(said: str) -> None:
    assert is_stop_for_other(said)
    assert not is_stop(said)


@pytest.mark.parametrize(
    "said",
    [
        *("stop", "please stop", "", "rover", "don't stop", "never stop", "rover, don't stop"),
        *("rover, stop following me", "where is the stop", "do not halt", "bus stop", "full stop"),
        *("look for a place to stop", "one two three four stop", "how to freeze"),
    ],
)
def test_not_every_sentence_that_ends_with_the_word_is_said_to_somebody(said: str) -> None:
    assert not is_stop_for_other(said)
