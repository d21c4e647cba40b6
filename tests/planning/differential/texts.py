"""Small problems in PDDL, one for each feature: a domain, a problem, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from nondum.planning.ground.ground import ground
from nondum.sdk.planner import GroundTask
from nondum_pddl_workbench.standalone import Standalone, load


@dataclass(frozen=True, slots=True)
class Text:
    """A domain and a problem."""

    name: str
    domain: str
    problem: str
    shortest: int | None
    """Length of a shortest plan; None: there is no plan."""

    def __str__(self) -> str:
        return self.name

    def load(self) -> Standalone:
        """As nondum reads it."""
        return load(self.domain, f"{self.name}.pddl", self.problem, f"{self.name}-problem.pddl")

    def task(self) -> GroundTask:
        """As nondum grounds it."""
        return _task(self)


@lru_cache(maxsize=256)
def _task(text: Text) -> GroundTask:
    loaded = text.load()
    return ground(loaded.merged, loaded.facts, loaded.goal)


def text(name: str, domain: str, problem: str, shortest: int | None) -> Text:
    """Put the sections of a domain and of a problem into their frames."""
    return Text(
        name,
        f"(define (domain {name})\n{domain})",
        f"(define (problem {name}-1) (:domain {name})\n{problem})",
        shortest,
    )


DERIVED = """(:predicates (near ?x ?y) (link ?x ?y) (joined ?x ?y) (cut ?x) (lonely ?x))
           (:derived (joined ?x ?y)
             (and (not (cut ?x)) (or (link ?x ?y) (exists (?z) (and (link ?x ?z) (joined ?z ?y))))))
           (:derived (lonely ?x) (forall (?y) (not (joined ?x ?y))))
           (:action connect :parameters (?x ?y)
             :precondition (and (near ?x ?y) (not (joined ?x ?y))) :effect (link ?x ?y))
           (:action cut :parameters (?x) :precondition (and) :effect (cut ?x))"""

TEXTS = (
    text(
        "strips",
        """(:predicates (at ?x) (road ?x ?y))
           (:action go :parameters (?x ?y) :precondition (and (at ?x) (road ?x ?y))
             :effect (and (at ?y) (not (at ?x))))""",
        """(:objects a b c d) (:init (at a) (road a b) (road b c) (road c a))
           (:goal (at c))""",
        2,
    ),
    text(
        "no-plan",
        """(:predicates (at ?x) (road ?x ?y))
           (:action go :parameters (?x ?y) :precondition (and (at ?x) (road ?x ?y))
             :effect (and (at ?y) (not (at ?x))))""",
        """(:objects a b) (:init (at a) (road b a)) (:goal (at b))""",
        None,
    ),
    text(
        "exhausted",
        """(:predicates (at ?x) (road ?x ?y))
           (:action go :parameters (?x ?y) :precondition (and (at ?x) (road ?x ?y))
             :effect (and (at ?y) (not (at ?x))))""",
        """(:objects a b c) (:init (at a) (road a b) (road a c)) (:goal (and (at b) (at c)))""",
        None,
    ),
    text(
        "already-true",
        """(:predicates (p) (q))
           (:action act :parameters () :precondition (p) :effect (q))""",
        """(:init (p) (q)) (:goal (q))""",
        0,
    ),
    text(
        "typing",
        """(:types truck plane - vehicle city vehicle package)
           (:predicates (at ?v - object ?c - city) (in ?p - package ?v - vehicle))
           (:action drive :parameters (?t - truck ?x - city ?y - city)
             :precondition (at ?t ?x) :effect (and (at ?t ?y) (not (at ?t ?x))))
           (:action load :parameters (?p - package ?v - vehicle ?c - city)
             :precondition (and (at ?p ?c) (at ?v ?c))
             :effect (and (in ?p ?v) (not (at ?p ?c))))""",
        """(:objects t - truck f - plane x y z - city p - package)
           (:init (at t x) (at f y) (at p z)) (:goal (in p t))""",
        2,
    ),
    text(
        "either",
        """(:types cup ball tool brush)
           (:predicates (on-table ?o - object) (held ?o - (either cup ball)) (dirty ?o))
           (:action pick :parameters (?o - (either cup ball)) :precondition (on-table ?o)
             :effect (and (held ?o) (not (on-table ?o))))
           (:action brush :parameters (?b - brush ?o - (either ball tool))
             :precondition (and (dirty ?o)) :effect (not (dirty ?o)))""",
        """(:objects c - cup b - ball t - tool s - brush)
           (:init (on-table c) (on-table b) (on-table t) (dirty b) (dirty t))
           (:goal (and (held c) (held b) (not (dirty t))))""",
        3,
    ),
    text(
        "several-parents",
        """(:types boat car - vehicle amphibian - boat amphibian - car vehicle)
           (:predicates (afloat ?b - boat) (parked ?c - car) (wet ?v - vehicle))
           (:action launch :parameters (?b - boat) :precondition (and)
             :effect (and (afloat ?b) (wet ?b)))
           (:action park :parameters (?c - car) :precondition (wet ?c)
             :effect (and (parked ?c)))""",
        """(:objects a - amphibian b - boat c - car) (:init)
           (:goal (and (afloat a) (parked a)))""",
        2,
    ),
    text(
        "constants",
        """(:constants home - object)
           (:predicates (at ?x) (door ?x))
           (:action leave :parameters (?x) :precondition (and (at home) (door ?x))
             :effect (and (not (at home)) (at ?x)))""",
        """(:objects home shop pub) (:init (at home) (door shop)) (:goal (at shop))""",
        1,
    ),
    text(
        "negation",
        """(:predicates (locked ?d) (open ?d) (seen ?d))
           (:action unlock :parameters (?d) :precondition (locked ?d) :effect (not (locked ?d)))
           (:action open :parameters (?d) :precondition (and (not (locked ?d)) (not (open ?d)))
             :effect (open ?d))
           (:action peep :parameters (?d) :precondition (not (open ?d)) :effect (seen ?d))""",
        """(:objects a b) (:init (locked a)) (:goal (and (open a) (seen a) (not (locked a))))""",
        3,
    ),
    text(
        "equality",
        """(:predicates (on ?x ?y) (clear ?x))
           (:action stack :parameters (?x ?y ?z)
             :precondition (and (clear ?x) (clear ?z) (on ?x ?y) (not (= ?x ?z)) (not (= ?y ?z)))
             :effect (and (on ?x ?z) (clear ?y) (not (on ?x ?y)) (not (clear ?z))))
           (:action swap :parameters (?x ?y) :precondition (and (= ?x ?y) (clear ?x))
             :effect (on ?x ?y))""",
        """(:objects a b c) (:init (clear a) (on a b) (clear c)) (:goal (and (on a c) (on b b)))""",
        2,
    ),
    text(
        "disjunction",
        """(:predicates (key) (card) (in) (code ?x) (tried ?x))
           (:action try :parameters (?x) :precondition (not (tried ?x))
             :effect (and (tried ?x) (code ?x)))
           (:action enter :parameters (?x)
             :precondition (and (or (key) (card) (code ?x)) (imply (card) (tried ?x)))
             :effect (in))""",
        """(:objects one two) (:init (card)) (:goal (and (in) (or (key) (tried two))))""",
        2,
    ),
    text(
        "disjunctions-in-rules",
        """(:types thing place)
           (:predicates (row ?a - place) (drawn) (column ?x - thing ?b - place) (placed ?x - thing)
             (shown ?x - thing))
           (:derived (shown ?x - thing) (exists (?a ?b - place) (and (row ?a) (column ?x ?b))))
           (:action draw :parameters (?a - place) :precondition (not (drawn))
             :effect (and (drawn) (row ?a)))
           (:action place :parameters (?x - thing ?b - place) :precondition (not (placed ?x))
             :effect (and (placed ?x) (column ?x ?b)))""",
        """(:objects p q - thing a b c d - place) (:init) (:goal (and (shown p) (shown q)))""",
        3,
    ),
    text(
        "quantifiers",
        """(:types lamp room)
           (:predicates (lit ?l - lamp) (inside ?l - lamp ?r - room) (bright ?r - room) (dark))
           (:action switch :parameters (?l - lamp) :precondition () :effect (lit ?l))
           (:action look :parameters (?r - room)
             :precondition (forall (?l - lamp) (imply (inside ?l ?r) (lit ?l)))
             :effect (bright ?r))
           (:action snuff :parameters (?r - room)
             :precondition (exists (?l - lamp) (and (lit ?l) (inside ?l ?r)))
             :effect (and (dark) (forall (?l - lamp) (not (lit ?l)))))""",
        """(:objects l m n - lamp r s - room)
           (:init (inside l r) (inside m r) (inside n s))
           (:goal (and (bright r) (dark) (forall (?l - lamp) (not (lit ?l)))))""",
        4,
    ),
    text(
        "conditional-effects",
        """(:types letter box)
           (:predicates (at ?b - box) (in ?l - letter ?b - box) (lost ?l - letter)
             (sealed ?l - letter) (moved))
           (:action carry :parameters (?b ?c - box) :precondition (at ?b)
             :effect (and (not (at ?b)) (at ?c) (moved)
               (forall (?l - letter) (when (in ?l ?b)
                 (and (not (in ?l ?b)) (in ?l ?c))))
               (when (moved) (forall (?l - letter) (when (not (sealed ?l)) (lost ?l))))))
           (:action seal :parameters (?l - letter) :precondition (and) :effect (sealed ?l))""",
        """(:objects k l - letter a b c - box) (:init (at a) (in k a) (in l b))
           (:goal (and (in k c) (in l b) (sealed l)))""",
        2,
    ),
    text(
        "derived",
        DERIVED,
        """(:objects a b c d) (:init (link a b) (link c d) (near a d) (near b c) (near c a))
           (:goal (and (joined a d) (lonely b)))""",
        1,
    ),
    text(
        "derived-with-a-plan",
        DERIVED,
        """(:objects a b c d) (:init (link a b) (link c d) (near a d) (near b c) (near c a))
           (:goal (and (joined a d) (lonely c)))""",
        2,
    ),
    text(
        "costs",
        """(:types place)
           (:predicates (at ?p - place) (paid))
           (:functions (total-cost) - number (far ?p ?q - place) - number)
           (:action walk :parameters (?p ?q - place) :precondition (at ?p)
             :effect (and (at ?q) (not (at ?p)) (increase (total-cost) (far ?p ?q))))
           (:action pay :parameters () :precondition (and)
             :effect (and (paid) (increase (total-cost) 5)))""",
        """(:objects a b c - place)
           (:init (at a) (= (total-cost) 0) (= (far a b) 1) (= (far b c) 2))
           (:goal (and (at c) (paid))) (:metric minimize (total-cost))""",
        3,
    ),
    text(
        "hiding-variables",
        """(:predicates (p ?x) (q ?x) (r ?x ?y))
           (:action act :parameters (?x)
             :precondition (and (p ?x) (exists (?x) (and (q ?x) (exists (?x_ ?x) (r ?x_ ?x)))))
             :effect (and (q ?x) (forall (?x) (when (p ?x) (not (p ?x))))))""",
        """(:objects a b) (:init (p a) (q b) (r a b)) (:goal (and (q a) (not (p a))))""",
        1,
    ),
    text(
        "add-wins",
        """(:predicates (p ?x) (q) (seen ?x))
           (:action touch :parameters (?x ?y) :precondition (p ?x)
             :effect (and (p ?y) (not (p ?x)) (when (q) (and (p ?x) (seen ?x)))))
           (:action on :parameters () :precondition () :effect (q))""",
        """(:objects a b) (:init (p a)) (:goal (and (p a) (p b) (seen a) (not (seen b))))""",
        2,
    ),
    text(
        "some-of-none",
        """(:types ghost - object)
           (:predicates (seen) (bare))
           (:action undress :parameters () :precondition () :effect (bare))
           (:action look :parameters ()
             :precondition (exists (?g ?h - ghost) (or (bare) (forall (?i - ghost) (and))))
             :effect (seen))""",
        """(:init) (:goal (and (bare) (seen)))""",
        None,
    ),
    text(
        "all-of-none",
        """(:types ghost - object)
           (:predicates (calm) (bare))
           (:action undress :parameters () :precondition () :effect (bare))
           (:action rest :parameters ()
             :precondition (forall (?g - ghost) (or (exists (?h - ghost) (or))))
             :effect (calm))""",
        """(:init) (:goal (and (bare) (calm) (forall (?g ?h - ghost) (or))))""",
        2,
    ),
)
"""Every feature that is read."""
