"""What `payload check` says of words that strangers do not share."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.kit.golden import Golden

from nondum.host.trust.vocabulary_check import judge
from nondum.sdk.description import Fragment, Input, Output, Phrase, PluginDescription, Unit


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
    assert warning.code == "PDDL_OWN_WORD"
    assert "'following'" in warning.fix


def test_a_word_like_none_of_the_core_may_be_kept(golden: Golden) -> None:
    (warning,) = judge({"x": plugin("zzz")}).warnings
    golden.check("no word of the core is near", warning.fix)


def test_a_phrase_that_asks_for_an_undeclared_word_is_a_problem() -> None:
    description = replace(plugin("lit"), phrases=(Phrase("shine", "(lti self)"),))
    (problem,) = judge({"x": description}).problems
    assert problem.code == "PHRASE_INVALID"


def test_a_fragment_that_no_host_would_plan_with_is_a_problem() -> None:
    description = PluginDescription("x", "1", fragments=(Fragment("domain.pddl", "(define (dom"),))
    assert judge({"x": description}).problems


POSE, BASE = "did you mean 'pose'?", "did you mean 'base'?"


@pytest.mark.parametrize(
    ("slot", "code", "fix"),
    [
        pytest.param(Input("odometry", "poze"), "PDDL_UNKNOWN", POSE, id="type of an input"),
        pytest.param(Input("odometry", "pose", of="bas"), "PDDL_UNKNOWN", BASE, id="of nothing"),
        pytest.param(Input("odometry", "camera"), "PDDL_TYPE", "", id="not a stream"),
        pytest.param(
            Input("odometry", "pose", of="pose"), "PDDL_TYPE", "", id="of what is no unit"
        ),
        pytest.param(
            Output("odometry", "pose", of="bas"), "PDDL_UNKNOWN", BASE, id="output of nothing"
        ),
        pytest.param(Output("odometry", "poze"), "PDDL_UNKNOWN", POSE, id="type of an output"),
    ],
)
def test_a_slot_that_nothing_could_fit_is_a_problem(
    slot: Input | Output, code: str, fix: str
) -> None:
    """Nothing else would say so: no plan asks for an optional input."""
    if isinstance(slot, Input):
        unit = Unit("eye", "camera", inputs=(slot,))
    else:
        unit = Unit("eye", "camera", outputs=(slot,))
    description = PluginDescription("x", "1", units=(unit,))
    (problem,) = judge({"x": description}).problems
    assert (problem.code, fix in problem.fix) == (code, True)


def test_slots_may_be_of_what_the_payload_declares() -> None:
    domain = "(define (domain x) (:types gait - stream leg - unit))"
    units = (Unit("legs", "leg", inputs=(Input("gait", "gait", of="leg"),)),)
    description = PluginDescription(
        "x", "1", fragments=(Fragment("domain.pddl", domain),), units=units
    )
    assert judge({"x": description}).problems == ()
