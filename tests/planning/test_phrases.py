"""Goals in words: phrases of one plugin, labels of another, and what is said when they fail."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.golden import Golden
from tests.planning.speaking import BASE, COMPTON, DETECTOR, POINTER, asked, book, saying
from tests.planning.strangers import (
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    ROVER,
    SPEAKER,
    components,
)

from nondum.planning.merge.goal import goal_text
from nondum.planning.merge.merge import merge
from nondum.planning.words.pattern import PatternInvalid, Word, parse_pattern
from nondum.planning.words.phrases import MAX_OFFERS, phrasebook
from nondum.sdk.description import Behaviour, Fragment, Label, Phrase, PluginDescription
from nondum.sdk.errors import GoalRefused


@pytest.mark.parametrize(
    "sentence",
    ["point at the radiation source", "Point at radiation-source!", "POINT AT radiation source"],
)
def test_phrase_and_label_of_two_strangers_meet(sentence: str) -> None:
    goal = book(POINTER, COMPTON).goal(sentence)
    assert asked(goal) == ("maintain", "(pointing rover radiation-source)")
    assert goal.text == sentence


@pytest.mark.parametrize(
    "sentence", ["follow me", "follow me through the facility", "follow people", "follow person"]
)
def test_free_words_bind_nothing(sentence: str) -> None:
    goal = book(BASE, DETECTOR).goal(sentence)
    assert asked(goal) == ("maintain", "(following rover person)")


def test_question_is_to_be_done_again_each_time() -> None:
    question = Phrase("where is {t:target}", "(bearing-known ?t self)", "do")
    compton = replace(COMPTON, phrases=(question,))
    goal = book(compton).goal("where is the radiation source")
    assert asked(goal) == ("do", "(bearing-known radiation-source rover)")


def test_finishing_behaviour_is_achieved() -> None:
    goal = book(saying(SPEAKER, "report {class}"), DETECTOR).goal("report people")
    assert asked(goal) == ("achieve", "(reported person rover)")


def test_slot_may_be_named_by_type() -> None:
    goal = book(saying(PAN_TILT_UNIT, "look at {target}"), COMPTON).goal("look at radiation source")
    assert goal_text(goal.expr) == "(pointing rover radiation-source)"


def test_same_meaning_twice_is_not_ambiguous() -> None:
    other = replace(BASE, name="other-base")
    assert book(BASE, other, DETECTOR).goal("follow me").kind == "maintain"


def test_different_meanings_are_told(golden: Golden) -> None:
    speaker = replace(
        saying(SPEAKER), phrases=(Phrase("follow {c:class}", "(reported ?c self)", "achieve"),)
    )
    with pytest.raises(GoalRefused) as refused:
        book(BASE, speaker, DETECTOR).goal("follow me")
    [problem] = refused.value.problems
    assert problem.code == "PHRASE_AMBIGUOUS"
    golden.check("two components mean other things", problem.message)


def test_label_of_two_objects_is_ambiguous(golden: Golden) -> None:
    goose = PluginDescription(
        "goose-detector", "1", fragments=DETECTOR.fragments[:1], labels=(Label("goose", "me"),)
    )
    text = goose.fragments[0].text.replace("person", "goose")
    goose = replace(
        goose, fragments=(replace(goose.fragments[0], text=text),), behaviours=DETECTOR.behaviours
    )
    with pytest.raises(GoalRefused) as refused:
        book(BASE, DETECTOR, goose).goal("follow me")
    [problem] = refused.value.problems
    assert problem.code == "PHRASE_AMBIGUOUS"
    golden.check("two names can be meant", problem.fix)


def test_unknown_sentence_gets_near_phrases() -> None:
    with pytest.raises(GoalRefused) as refused:
        book(POINTER, COMPTON, BASE, DETECTOR).goal("please point on the radiation source")
    problem = refused.value.problems[0]
    assert problem.code == "PHRASE_UNKNOWN"
    assert '"point at the radiation source"' in problem.fix


def test_who_speaks_where_nothing_knows_words_is_not_sent_to_look_for_some() -> None:
    with pytest.raises(GoalRefused) as refused:
        book().goal("follow me")
    problem = refused.value.problems[0]
    assert problem.code == "PHRASE_UNKNOWN"
    assert problem.fix.startswith("plug in")


def test_unknown_name_gets_known_ones() -> None:
    with pytest.raises(GoalRefused) as refused:
        book(POINTER, COMPTON).goal("point at the moon")
    problem = refused.value.problems[0]
    assert problem.code == "PHRASE_WORDS_UNKNOWN"
    assert all(name in problem.message for name in ("target", "'the moon'"))
    assert '"the radiation source"' in problem.fix


def test_name_of_another_type_is_not_taken() -> None:
    with pytest.raises(GoalRefused, match=r"target .*'me'") as refused:
        book(POINTER, COMPTON, DETECTOR).goal("point at me")
    assert refused.value.code == "PHRASE_WORDS_UNKNOWN"


def test_offers_list_what_can_be_said() -> None:
    assert book(POINTER, COMPTON, BASE, DETECTOR).offers() == (
        "follow me",
        "point at the radiation source",
    )


def test_listed_sentences_are_bounded() -> None:
    names = " ".join(f"thing-{i}" for i in range(MAX_OFFERS * 2))
    many = PluginDescription(
        "many",
        "1",
        fragments=(
            Fragment("m.pddl", f"(define (problem m) (:domain m) (:objects {names} - class))"),
        ),
        phrases=(Phrase("{a:class} meets {b:class} near {c:class}", "(following self ?a)"),),
    )
    assert len(book(many).offers()) == MAX_OFFERS


def test_phrase_without_things_to_name_is_not_offered() -> None:
    assert book(POINTER).offers() == ()


@pytest.mark.parametrize(
    ("pattern", "why"),
    [
        ("point at {x}", "no parameter"),
        ("point [at {t}]", "cannot name"),
        ("{t}", "no word"),
        ("point at {t", "not understood"),
        ("point ] at {t}", "closes nothing"),
        ("point [at {t}", "not closed"),
        ("point", "nothing true of what is named"),
    ],
)
def test_bad_pattern_is_told(pattern: str, why: str) -> None:
    problems = book(saying(PAN_TILT_UNIT, pattern), COMPTON).problems
    assert [problem.code for problem in problems] == ["PHRASE_INVALID"]
    assert why in problems[0].message


@pytest.mark.parametrize(
    ("goal", "why"),
    [
        ("(following self ?x)", "?x is not a parameter"),
        ("(follow self ?c)", "did you mean 'following'?"),
        ("(following self", "expected"),
        ("(or (following self ?c))x", "expected the end"),
    ],
)
def test_bad_goal_of_a_phrase_is_told(goal: str, why: str) -> None:
    plugin = replace(MOBILE_BASE, phrases=(Phrase("follow {c:class}", goal),))
    [problem] = book(plugin).problems
    assert problem.code == "PHRASE_INVALID"
    assert why in str(problem)


def test_quarantined_component_says_nothing() -> None:
    wrong = replace(BASE, behaviours=(Behaviour("drive", "(drive ?u - base)"),))
    contributions = components([wrong, DETECTOR])
    merged = merge(contributions, ROVER)
    assert list(merged.quarantined) == ["mobile-base"]
    assert phrasebook(contributions, merged).offers() == ()


words = st.from_regex(r"[a-z]{1,8}", fullmatch=True)


@given(st.text(alphabet="ab {}[]:-?x", max_size=30))
def test_any_text_is_a_pattern_or_refused(text: str) -> None:
    try:
        parts = parse_pattern(text)
    except PatternInvalid as refused:
        assert str(refused)
    else:
        assert any(isinstance(part, Word) for part in parts)


@given(st.lists(words, min_size=1, max_size=4), st.lists(words, min_size=1, max_size=3))
def test_what_is_offered_is_understood(said: list[str], label: list[str]) -> None:
    pattern = f"{' '.join(said)} {{c:class}} [or {{more:text}}]"
    base = replace(MOBILE_BASE, phrases=(Phrase(pattern, "(following self ?c)", "maintain"),))
    detector = replace(PEOPLE_DETECTOR, labels=(Label("person", " ".join(label)),))
    known = book(base, detector)
    [sentence] = known.offers()
    for spoken in (sentence, sentence.upper(), f"{sentence}, or whatever!"):
        assert asked(known.goal(spoken)) == ("maintain", "(following rover person)")
