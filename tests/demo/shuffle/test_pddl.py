"""Names in PDDL are found by the part they play, and nothing else is touched."""

from __future__ import annotations

import doctest

import pytest
from demo.shuffle import pddl
from demo.shuffle.pddl import Part

DOMAIN = """\
; a camera's camera
(define (domain Camera)
  (:requirements :strips :typing)
  (:types lens - camera pane hatch - (either object place))
  (:constants camera - lens)
  (:predicates (seen ?x - lens ?y) (bright))
  (:valued seen) (:functional bright)
  (:functions (total-cost) - number)
  (:action camera
    :parameters (?u - (either camera lens) ?v)
    :precondition (and (seen ?u camera) (or (not (bright)) (= ?u camera)))
    :effect (and (forall (?x - lens) (when (bright) (seen ?x pane-1))) (increase (total-cost) 2))))
"""


def found(part: Part, text: str = DOMAIN) -> list[str]:
    return [token.text for kind, token in pddl.fragment(text) if kind is part]


def test_one_word_may_play_every_part() -> None:
    assert found(Part.DOMAIN) == ["camera"]
    assert found(Part.ACTION) == ["camera"]
    assert found(Part.OBJECT) == ["camera", "camera", "camera", "pane-1"]
    assert found(Part.TYPE).count("camera") == 2


def test_types_are_found_on_both_sides_of_the_dash() -> None:
    assert found(Part.TYPE) == [
        *("lens", "camera", "pane", "hatch", "object", "place"),
        *("lens", "lens", "camera", "lens", "lens"),
    ]


def test_predicates_are_found_wherever_they_stand() -> None:
    assert set(found(Part.PREDICATE)) == {"seen", "bright", "total-cost"}
    assert found(Part.PREDICATE).count("seen") == 4


def test_only_the_part_asked_for_is_renamed() -> None:
    def rename(part: Part, name: str) -> str:
        return "NEW" if part is Part.ACTION else name

    now = pddl.renamed(DOMAIN, pddl.fragment(DOMAIN), rename)
    assert now == DOMAIN.replace("Camera)", "camera)").replace(":action camera", ":action NEW")


def test_a_goal_and_a_signature_have_names() -> None:
    assert [t.text for _, t in pddl.formula("(and (near self ?t) (not (far a)))")] == [
        *("near", "self"),
        *("far", "a"),
    ]
    assert [(p, t.text) for p, t in pddl.signature("(go ?u - base ?x)")] == [
        (Part.ACTION, "go"),
        (Part.TYPE, "base"),
    ]


@pytest.mark.parametrize(
    "text", ["(define (domain a)", "define)", "(define a)", "(define (domain a) b)"]
)
def test_what_is_no_fragment_is_told(text: str) -> None:
    with pytest.raises(ValueError, match=r"brackets|stands where"):
        list(pddl.fragment(text))


def test_examples_in_the_docstrings_hold() -> None:
    assert doctest.testmod(pddl).failed == 0
