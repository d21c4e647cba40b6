"""A planning problem that no planner is done with in the time of a test."""

from __future__ import annotations

ENDLESS = """(define (domain holes)
  (:types pigeon hole)
  (:predicates (out ?p - pigeon) (free ?h - hole) (in ?p - pigeon ?h - hole) (home ?p - pigeon))
  (:action enter :parameters (?p - pigeon ?h - hole) :precondition (and (out ?p) (free ?h))
    :effect (and (in ?p ?h) (home ?p) (not (out ?p)) (not (free ?h))))
  (:action leave :parameters (?p - pigeon ?h - hole) :precondition (in ?p ?h)
    :effect (and (out ?p) (free ?h) (not (in ?p ?h)) (not (home ?p)))))
"""


def endless() -> str:
    """Fourteen pigeons for thirteen holes, which no search through all states proves."""
    pigeons, holes = [f"p{n}" for n in range(14)], [f"h{n}" for n in range(13)]
    outside = [f"(out {pigeon})" for pigeon in pigeons] + [f"(free {hole})" for hole in holes]
    return (
        "(define (problem endless) (:domain holes)"
        f"(:objects {' '.join(pigeons)} - pigeon {' '.join(holes)} - hole)"
        f"(:init {' '.join(outside)})"
        f"(:goal (and {' '.join(f'(home {p})' for p in pigeons)})))"
    )
