"""What the model is asked, and which of its answers are taken."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum_phrase_choice.choice import (
    LONGEST_SAID,
    NO_SENTENCE,
    AnswerRefused,
    instructions,
    phrases_of,
    schema,
    sentence,
)

PHRASES = {
    "follow me": {},
    "search for {class}": {"class": ["people", "pedestrians"]},
    "point at {target} and say {words}": {"target": ["the source"], "words": []},
}


def answer(pattern: object, **slots: object) -> str:
    return json.dumps({"goal": {"pattern": pattern, "slots": slots}})


def test_phrases_are_those_that_the_host_tells() -> None:
    told = [{"words": words, "slots": slots} for words, slots in PHRASES.items()]
    assert phrases_of({"host": "rover", "phrases": told}) == PHRASES
    assert phrases_of({"host": "rover"}) == {}


def test_names_of_phrases_that_are_alike_are_taken_together() -> None:
    one, other = ({"words": "find {c}", "slots": {"c": names}} for names in (["a"], ["b", "a"]))
    assert phrases_of({"phrases": [one, other]}) == {"find {c}": {"c": ["a", "b"]}}


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        (answer("follow me"), "follow me"),
        (answer("search for {class}", **{"class": "people"}), "search for people"),
        (
            answer("point at {target} and say {words}", target="the source", words="a {b} c"),
            "point at the source and say a {b} c",
        ),
    ],
)
def test_chosen_phrase_is_said_with_its_names(said: str, meant: str) -> None:
    assert sentence(said, PHRASES) == meant


@pytest.mark.parametrize("instead", NO_SENTENCE)
def test_model_may_say_that_no_sentence_means_that(instead: str) -> None:
    assert sentence(json.dumps({"goal": instead}), PHRASES) is None


@pytest.mark.parametrize(
    "said",
    [
        "",
        "I would follow you.",
        '{"goal": {"pattern": "follow me", "slots"',
        "[" * 100_000,
        "7",
        '{"goal": "follow me"}',
        '{"goal": null}',
        '{"words": "follow me"}',
        answer("drive away"),
        answer(["follow me"]),
        answer("follow me", speed="fast"),
        answer("search for {class}"),
        answer("search for {class}", **{"class": "tanks"}),
        answer("search for {class}", **{"class": ["people"]}),
        answer("search for {class}", **{"class": "people", "host": "mule"}),
        answer("point at {target} and say {words}", target="the source", words=" "),
        answer("point at {target} and say {words}", target="the source", words=7),
        answer(
            "point at {target} and say {words}", target="the source", words="a" * (LONGEST_SAID + 1)
        ),
    ],
)
def test_what_was_not_offered_is_refused(said: str) -> None:
    with pytest.raises(AnswerRefused):
        sentence(said, PHRASES)


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text() | st.sampled_from(sorted(PHRASES)),
    lambda inner: (
        st.lists(inner)
        | st.dictionaries(st.sampled_from(["goal", "pattern", "slots", "class"]) | st.text(), inner)
    ),
)


@given(st.text() | _JSON.map(json.dumps))
def test_whatever_it_answers_is_a_phrase_none_or_refused(said: str) -> None:
    try:
        meant = sentence(said, PHRASES)
    except AnswerRefused:
        return
    assert meant in (None, "follow me", "search for people", "search for pedestrians")


def test_instructions_say_every_phrase_and_name() -> None:
    told = instructions(PHRASES)
    assert "- follow me\n" in told
    assert "- search for {class}; class: people, pedestrians\n" in told
    assert "words: any words\n" in told
    assert all(f'"{name}"' in told for name in NO_SENTENCE)


def test_schema_has_a_choice_for_each_phrase_and_what_there_is_instead() -> None:
    *choices, instead = schema(PHRASES)["properties"]["goal"]["anyOf"]
    assert instead == {"enum": list(NO_SENTENCE)}
    (class_,) = (slots(one)["class"] for one in choices if "class" in slots(one))
    assert class_ == {"enum": ["people", "pedestrians"]}
    assert [one["properties"]["pattern"]["enum"] for one in choices] == [[p] for p in PHRASES]


def slots(choice: dict[str, Any]) -> dict[str, Any]:
    assert choice["additionalProperties"] is False
    assert choice["required"] == ["pattern", "slots"]
    return choice["properties"]["slots"]["properties"]  # type: ignore[no-any-return]
