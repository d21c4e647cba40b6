"""What `payload check` says of words that strangers do not share."""

from __future__ import annotations

from dataclasses import replace

from nondum.host.vocabulary_check import judge
from nondum.sdk.description import Fragment, Phrase, PluginDescription, Unit


def plugin(predicate: str) -> PluginDescription:
    domain = f"(define (domain x) (:predicates ({predicate} ?h - host)))"
    return PluginDescription(
        "x", "1", fragments=(Fragment("domain.pddl", domain),), units=(Unit("lamp", "light"),)
    )


def test_core_words_alone_are_no_matter() -> None:
    description = PluginDescription("x", "1", units=(Unit("lamp", "light"),))
    judged = judge({"x": description})
    assert (judged.problems, judged.warnings) == ((), ())


def test_a_near_miss_of_a_core_word_is_named() -> None:
    (warning,) = judge({"x": plugin("folowing")}).warnings
    assert warning.code == "W-OWN-WORD"
    assert "'following'" in warning.fix


def test_a_word_like_none_of_the_core_may_be_kept() -> None:
    (warning,) = judge({"x": plugin("zzz")}).warnings
    assert warning.fix == "keep it if no word of nondum-core means the same"


def test_a_phrase_that_asks_for_an_undeclared_word_is_a_problem() -> None:
    description = replace(plugin("lit"), phrases=(Phrase("shine", "(lti self)"),))
    (problem,) = judge({"x": description}).problems
    assert problem.code == "PHRASE_INVALID"


def test_a_fragment_that_no_host_would_plan_with_is_a_problem() -> None:
    description = PluginDescription("x", "1", fragments=(Fragment("domain.pddl", "(define (dom"),))
    assert judge({"x": description}).problems
