"""PDDL texts are read with places, or refused with a caret under the culprit."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.planning.pddl.parse import (
    NAME_LIMIT,
    SIZE_LIMIT_BYTES,
    parse_formula,
    parse_fragment,
    parse_signature,
)
from nondum.planning.pddl.syntax import (
    And,
    Atom,
    DomainFragment,
    Equal,
    Imply,
    Not,
    Numeric,
    Or,
    Place,
    ProblemFragment,
    Quantified,
    When,
)
from nondum.sdk.errors import FragmentRefused, Problem

DOMAIN = """\
; A comment with (brackets and "quotes
(define (domain Freight)
  (:requirements :strips :typing :action-costs)
  (:types truck - (either vehicle asset) vehicle asset room)
  (:constants depot - room)
  (:predicates (at ?t - truck ?r - (either room vehicle)) (Locked ?r))
  (:functions (total-cost) - number)
  (:valued locked - pose)
  (:functional at)
  (:action move
    :parameters (?t - truck ?from ?to - room)
    :precondition (and (at ?t ?from) (not (locked ?to)) (not (= ?from ?to)))
    :effect (and (at ?t ?to) (not (at ?t ?from)) (increase (total-cost) 3))))
"""


def refused(text: str) -> Problem:
    with pytest.raises(FragmentRefused) as error:
        parse_fragment(text, "d.pddl")
    return error.value.problems[0]


def domain(text: str) -> DomainFragment:
    parsed = parse_fragment(text, "d.pddl")
    assert isinstance(parsed, DomainFragment)
    return parsed


def test_domain_is_read_whole() -> None:
    parsed = domain(DOMAIN)
    assert parsed.name == "freight"
    assert [str(t) for t in parsed.types] == [
        "truck - (either vehicle asset)",
        "vehicle",
        "asset",
        "room",
    ]
    assert [str(c) for c in parsed.constants] == ["depot - room"]
    assert str(parsed.predicates[0]) == "(at ?t - truck ?r - (either room vehicle))"
    assert [str(name) for name in parsed.valued] == ["locked - pose"]
    assert [name.name for name in parsed.functional] == ["at"]
    [move] = parsed.actions
    assert [p.types for p in move.parameters] == [("truck",), ("room",), ("room",)]
    assert str(move.precondition) == "(and (at ?t ?from) (not (locked ?to)) (not (= ?from ?to)))"
    assert str(move.effect).endswith("(increase (total-cost) 3))")


def test_names_know_their_place() -> None:
    [move] = domain(DOMAIN).actions
    assert move.place == Place("d.pddl", 10, 12)
    assert isinstance(move.precondition, And)
    assert str(move.precondition.parts[0].place) == "d.pddl:12:25"


def test_places_do_not_count_in_comparison() -> None:
    moved = domain(DOMAIN.replace("(:action", "\n\n (:action"))
    assert moved == domain(DOMAIN)


def test_problem_is_read_whole() -> None:
    parsed = parse_fragment(
        """(define (problem one) (:domain freight) (:objects t1 - truck spare)
             (:init (at t1 depot) (= (total-cost) 0)) (:goal (not (at t1 depot)))
             (:metric minimize (total-cost)))""",
        "p.pddl",
    )
    assert isinstance(parsed, ProblemFragment)
    assert (parsed.name, parsed.domain) == ("one", "freight")
    assert [str(o) for o in parsed.objects] == ["t1 - truck", "spare"]
    assert [str(f) for f in parsed.init] == ["(at t1 depot)", "(= (total-cost) 0)"]
    assert str(parsed.goal) == "(not (at t1 depot))"


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("()", And),
        ("(and)", And),
        ("(or (a) (b ?x))", Or),
        ("(not (a))", Not),
        ("(imply (a) (b))", Imply),
        ("(forall (?x - room) (locked ?x))", Quantified),
        ("(exists (?x ?y - (either room truck)) (at ?x ?y))", Quantified),
        ("(when (a) (not (b)))", When),
        ("(= ?x depot)", Equal),
        ("(>= (fuel ?t) 3)", Numeric),
        ("(increase (total-cost) (distance ?x ?y))", Numeric),
        ("(domain define)", Atom),
        ("(android assignment)", Atom),
    ],
    ids=str,
)
def test_formula_is_read_and_written_back(text: str, kind: type) -> None:
    formula = parse_formula(text, "f")
    assert isinstance(formula, kind)
    assert parse_formula(str(formula), "f") == formula


def test_case_does_not_count() -> None:
    assert parse_formula("(AT ?T Depot)", "f") == parse_formula("(at ?t depot)", "f")


def test_signature_is_read() -> None:
    parsed = parse_signature("(point ?u - pointer ?t - target)", "s")
    assert str(parsed) == "(point ?u - pointer ?t - target)"


SYNTAX_ERRORS = {
    "nothing": ("", "1:1", "expected '(', found the end of the text"),
    "unclosed": ("(define (domain d)", "1:19", "found the end of the text"),
    "section": ("(define (domain d) (:typos a))", "1:21", "found ':typos'"),
    "no type": ("(define (domain d) (:types a - ))", "1:32", "expected '(' or a name, found ')'"),
    "no name": ("(define (domain d) (:types - a))", "1:30", "expected a name before '-'"),
    "glued": ("(define (domain d) (:typesa))", "1:21", "found ':typesa'"),
    "sign": ("(define (domain d) (:types $))", "1:28", "found '$'"),
    "variable": (
        "(define (domain d) (:action a :parameters (x)))",
        "1:44",
        "found 'x'",
    ),
    "too much": ("(define (domain d)) x", "1:21", "expected the end"),
    "comment": ("; nothing but this", "1:1", "expected '(', found the end of the text"),
    "number": (
        "(define (problem p) (:init (= (f) .5)))",
        "1:35",
        "expected '(' or a name or a number or a variable, found '.5'",
    ),
    "long": ("(define (domain d) (:types a " + "$" * 150 + "))", "1:30", "$$$…'"),
}


@pytest.mark.parametrize(("text", "place", "message"), SYNTAX_ERRORS.values(), ids=SYNTAX_ERRORS)
def test_syntax_error_names_place_and_expectation(text: str, place: str, message: str) -> None:
    problem = refused(text)
    assert problem.code == "PDDL_SYNTAX"
    assert problem.where == f"d.pddl:{place}"
    assert message in problem.message


def test_caret_stands_under_the_culprit() -> None:
    message = refused("(define (domain d)\n\t(:typos a))").message
    assert message.splitlines()[1:] == ["\t(:typos a))", "\t ^"]


def test_of_a_long_line_what_stands_around_the_culprit_is_shown() -> None:
    message = refused("(define (domain d) " + " " * 5000 + "(:typos a)" + " " * 5000 + ")").message
    _, line, below = message.splitlines()
    assert len(line) < 200
    assert line[below.index("^") :].startswith(":typos a)")


@pytest.mark.parametrize("sign", ["\v", "\f\v", "\x1c", "\u2028", "\x85", "\xa0"], ids=ascii)
def test_only_line_feeds_count_as_lines(sign: str) -> None:
    """What Python, but no editor, takes for the end of a line does not move the caret."""
    message = refused(f"(define (domain d)\n{sign}\n(:typos a))").message
    assert "expected" in message
    _, line, below = message.splitlines()
    assert line[below.index("^")] == "\N{REPLACEMENT CHARACTER}"


def test_byte_order_mark_is_passed_over() -> None:
    assert domain("\ufeff" + DOMAIN) == domain(DOMAIN)
    message = refused("\ufeff(define (domain d) (:typos a))").message
    assert message.splitlines()[1:] == ["(define (domain d) (:typos a))", " " * 20 + "^"]


def test_nearest_keyword_is_suggested() -> None:
    assert "':predicates'" in refused("(define (domain d) (:predicate (a)))").fix


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("(define (domain d) (:durative-action a))", "durative actions are not handled"),
        ("(define (domain d) (:constraints (and)))", "trajectory constraints are not handled"),
        ("(define (domain d) (:process a))", "processes are not handled"),
        ("(define (problem d) (:goal (preference p (a))))", "preferences are not handled"),
        ("(define (problem d) (:init (at 5 (a))))", "facts that become true at a time are not"),
        ("(define (problem d) (:init (= (f) -5)))", "negative numbers are not handled"),
        ("(define (problem d) (:metric minimize (total-time)))", "metric 'total-time' is not"),
        ("(define (problem d) (:metric maximize (x)))", "metrics that maximize are not handled"),
    ],
)
def test_what_is_not_handled_is_named(text: str, message: str) -> None:
    problem = refused(text)
    assert problem.code == "PDDL_UNSUPPORTED"
    assert problem.message.startswith(message)


@pytest.mark.parametrize(
    "text",
    [
        "(define (domain d) (:types a) (:types b))",
        "(define (domain d) (:action a :effect (x) :effect (y)))",
        "(define (domain d) (:action a :parameters (?x ?x)))",
    ],
)
def test_what_stands_twice_is_refused(text: str) -> None:
    assert refused(text).code == "PDDL_TWICE"


def test_deep_brackets_are_refused() -> None:
    assert refused("(" * 100_000).code == "PDDL_TOO_DEEP"


def test_long_names_are_refused_where_they_stand() -> None:
    problem = refused("(define (domain d) (:types\n a " + "b" * (NAME_LIMIT + 1) + "))")
    assert (problem.code, problem.where) == ("PDDL_TOO_BIG", "d.pddl:2:4")
    assert domain("(define (domain d) (:types " + "b" * NAME_LIMIT + "))")


def test_long_text_is_refused() -> None:
    problem = refused(" " * (SIZE_LIMIT_BYTES + 1))
    assert problem.code == "PDDL_TOO_BIG"
    assert problem.have == str(SIZE_LIMIT_BYTES + 1)


WORDS = ":types :action :parameters define domain problem and or not forall a b 3 = < ?x"
PIECES = st.sampled_from(["(", ")", "-", ";", "\n", "?", *WORDS.split()])


@given(st.lists(PIECES, max_size=40).map(" ".join))
def test_any_text_is_read_or_refused(text: str) -> None:
    for start in ("", "(define (domain d) ", "(define (problem p) "):
        try:
            parse_fragment(start + text, "d.pddl")
        except FragmentRefused as error:
            assert error.problems[0].where.startswith("d.pddl:")


@given(st.text(max_size=60))
def test_any_characters_are_read_or_refused(text: str) -> None:
    try:
        parse_formula(text, "f")
    except FragmentRefused as error:
        assert error.problems[0].where.startswith("f:")
