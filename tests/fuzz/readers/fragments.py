"""Fragments of a planning domain, and goals."""

from __future__ import annotations

from tests.fuzz.target import Target, of_text

from nondum.planning.merge.claims import claims_of
from nondum.planning.merge.contribution import Contribution
from nondum.planning.pddl.parse import parse_formula
from nondum.sdk.description import Fragment
from nondum.sdk.errors import FragmentRefused

WHERE = "fuzzed"

DOMAIN = b"""\
(define (domain lamp)
  (:requirements :strips :typing)
  (:types lamp - pointer colour - object)
  (:constants red - colour)
  (:predicates (lit ?l - lamp ?c - colour) (bright ?l - lamp))
  (:derived (bright ?l - lamp) (exists (?c - colour) (lit ?l ?c)))
  (:action light
    :parameters (?l - lamp ?c - colour)
    :precondition (and (not (lit ?l ?c)) (or (bright ?l) (= ?l ?l)))
    :effect (and (lit ?l ?c) (forall (?d - colour) (when (lit ?l ?d) (not (lit ?l ?d))))
                 (increase (total-cost) 3))))
"""

PROBLEM = b"""\
(define (problem lamp) (:domain lamp) (:objects source - target) (:init (senses lamp source)))
"""

GOAL = b"(and (lit a red) (not (lit b red)))"

PDDL = (b"(and", b"(or", b"(not", b"(forall (?x - t)", b"(exists (?x)", b"(when", b"(either a b)")


def _read_fragment(text: str) -> object:
    """Parsed, and then checked as one component's claim."""
    said = Contribution("lamp", "spot", "lamp", "1.0", fragments=(Fragment(WHERE, text),))
    claims = claims_of.__wrapped__(said)
    if claims.problems:
        raise FragmentRefused(*claims.problems)
    return claims


TARGETS = (
    Target("fragment", of_text(_read_fragment), lambda: [DOMAIN, PROBLEM], tokens=PDDL),
    Target(
        "goal",
        of_text(lambda t: parse_formula(t, WHERE)),
        lambda: [GOAL],
        tokens=PDDL,
    ),
)
