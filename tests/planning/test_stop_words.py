"""A robot stops at a word, and at no sentence that says something else."""

from __future__ import annotations

import pytest

from nondum.planning.words.stop_words import (
    STOPS,
    host_behind_stop,
    is_stop,
    is_stop_before_name,
    is_stop_for_other,
)


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


@pytest.mark.parametrize("stop", STOPS)
@pytest.mark.parametrize("form", ["{}, rover", "please {} the rover now", "{} rover, {}!"])
def test_a_known_name_may_come_behind(form: str, stop: str) -> None:
    said = form.format(stop, stop)
    assert host_behind_stop(said, ["big-mule", "rover"]) == "rover"
    assert not is_stop(said)


@pytest.mark.parametrize(
    ("said", "host"),
    [
        *(("stop it, big mule", "big-mule"), ("halt big-mule right now", "big-mule")),
        *(("stop mule", "mule"), ("stop the mule", "mule"), ("stop that, mule", "mule")),
        ("freeze robot 1", "robot-1"),
    ],
)
def test_the_whole_name_is_said_behind(said: str, host: str) -> None:
    assert host_behind_stop(said, ["mule", "big-mule", "robot-1"]) == host


@pytest.mark.parametrize(
    "said",
    [
        *("stop", "rover", "rover, stop", "stop following rover", "stop at rover", "stop big"),
        *("please stop rover and wait", "look at rover", "don't stop rover", "never stop rover"),
        *("stop rovers", "stop river", "stop all", "", "stop " * 20 + "rover"),
    ],
)
def test_a_name_behind_is_not_all_that_comes_behind(said: str) -> None:
    assert host_behind_stop(said, ["rover", "big-mule", "all"]) is None


@pytest.mark.parametrize(
    "said", ["Stop, river!", "halt big-mule", "please stop river now", "don't move, scout"]
)
def test_a_name_that_no_host_has_is_one_word_behind(said: str) -> None:
    assert is_stop_before_name(said)
    assert not is_stop(said)
    assert not is_stop_for_other(said)


@pytest.mark.parametrize(
    "said",
    [
        *("stop", "stop now", "stop the lamp", "halt at the door", "stop following me", "stop me"),
        *("stop recording", "stop here", "stop this song", "stop all motors", "halt at lamp", ""),
        *("halt 3", "stop the music", "halt the people"),
        *("stop big mule", "stop when", "don't stop river", "bus stop", "look for a stop", "stopp"),
    ],
)
def test_a_sentence_that_goes_on_is_no_name_behind(said: str) -> None:
    assert not is_stop_before_name(said)
