"""Problems of ten families, each in sizes from small to hopeless, as texts of PDDL."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

Texts = tuple[str, str]
"""Domain and problem."""


def _hanoi(discs: int) -> Texts:
    """2^n - 1 steps."""
    domain = """(define (domain hanoi) (:requirements :strips)
      (:predicates (clear ?x) (on ?x ?y) (smaller ?x ?y))
      (:action move :parameters (?disc ?from ?to)
        :precondition (and (smaller ?to ?disc) (on ?disc ?from) (clear ?disc) (clear ?to))
        :effect (and (clear ?from) (on ?disc ?to) (not (on ?disc ?from)) (not (clear ?to)))))"""
    names = [f"d{n}" for n in range(discs)]
    smaller = [f"(smaller {p} {d})" for d in names for p in ("a", "b", "c")]
    smaller += [f"(smaller d{big} d{n})" for n in range(discs) for big in range(n + 1, discs)]
    stack = [*names, "a"]
    on = [f"(on {x} {y})" for x, y in pairwise(stack)]
    goal = [f"(on {x} {y})" for x, y in zip(names, [*names[1:], "c"], strict=True)]
    init = [*smaller, *on, "(clear d0)", "(clear b)", "(clear c)"]
    return domain, _problem("hanoi", ["a", "b", "c", *names], init, goal)


def _counter(bits: int) -> Texts:
    """2^n steps, one way only."""
    actions = []
    for bit in range(bits):
        low = " ".join(f"(one b{n})" for n in range(bit))
        down = " ".join(f"(not (one b{n}))" for n in range(bit))
        actions.append(
            f"(:action up{bit} :parameters () :precondition (and (not (one b{bit})) {low})"
            f" :effect (and (one b{bit}) {down}))"
        )
    names = [f"b{n}" for n in range(bits)]
    constants = f"(:constants {' '.join(names)})"
    head = "(define (domain counter) (:requirements :strips :negative-preconditions)"
    domain = f"{head} {constants} (:predicates (one ?b)) {' '.join(actions)})"
    return domain, _problem("counter", [], [], [f"(one {name})" for name in names])


def _tiles(width: int, *, twisted: bool = False) -> Texts:
    """A sliding puzzle; twisted, it has no solution."""
    cells = [f"c{x}-{y}" for y in range(width) for x in range(width)]
    tiles = [f"t{n}" for n in range(1, width * width)]
    domain = """(define (domain tiles) (:requirements :strips)
      (:predicates (at ?t ?c) (blank ?c) (next ?c ?d))
      (:action slide :parameters (?t ?c ?d)
        :precondition (and (at ?t ?c) (blank ?d) (next ?c ?d))
        :effect (and (at ?t ?d) (blank ?c) (not (at ?t ?c)) (not (blank ?d)))))"""
    following = [
        f"(next c{x}-{y} c{x + dx}-{y + dy})"
        for y in range(width)
        for x in range(width)
        for dx, dy in ((0, 1), (1, 0), (0, -1), (-1, 0))
        if 0 <= x + dx < width and 0 <= y + dy < width
    ]
    order, blank = [*tiles, ""], width * width - 1
    chance = random.Random(width)
    for _ in range(200 * width):  # by moves, so that there is a way back
        steps = [s for s in (-1, 1, -width, width) if _is_step(blank, s, width)]
        to = blank + chance.choice(steps)
        order[blank], order[to], blank = order[to], order[blank], to
    if twisted:
        first, second = [n for n, tile in enumerate(order) if tile][:2]
        order[first], order[second] = order[second], order[first]
    init = [*following, f"(blank {cells[blank]})"]
    init += [f"(at {tile} {cell})" for tile, cell in zip(order, cells, strict=True) if tile]
    goal = [f"(at {tile} {cell})" for tile, cell in zip(tiles, cells, strict=False)]
    return domain, _problem("tiles", [*cells, *tiles], init, goal)


def _is_step(at: int, step: int, width: int) -> bool:
    to = at + step
    in_a_row = at // width == to // width or abs(step) == width
    return 0 <= to < width * width and in_a_row


def _twisted_tiles(width: int) -> Texts:
    return _tiles(width, twisted=True)


def _pigeons(holes: int) -> Texts:
    """One pigeon more than holes: true relaxed, false in truth."""
    domain = """(define (domain pigeons) (:requirements :strips)
      (:predicates (free ?h) (loose ?p) (housed ?p) (in ?p ?h))
      (:action enter :parameters (?p ?h) :precondition (and (loose ?p) (free ?h))
        :effect (and (in ?p ?h) (housed ?p) (not (free ?h)) (not (loose ?p))))
      (:action leave :parameters (?p ?h) :precondition (in ?p ?h)
        :effect (and (loose ?p) (free ?h) (not (in ?p ?h)) (not (housed ?p)))))"""
    pigeons, places = [f"p{n}" for n in range(holes + 1)], [f"h{n}" for n in range(holes)]
    init = [f"(free {h})" for h in places] + [f"(loose {p})" for p in pigeons]
    goal = [f"(housed {p})" for p in pigeons]
    return domain, _problem("pigeons", [*pigeons, *places], init, goal)


def _crowd(robots: int) -> Texts:
    """Robots in a corridor that have to swap sides, with one bay to let another pass."""
    length = robots + 3
    domain = """(define (domain crowd) (:requirements :strips)
      (:predicates (at ?r ?c) (empty ?c) (next ?c ?d))
      (:action go :parameters (?r ?c ?d)
        :precondition (and (at ?r ?c) (empty ?d) (next ?c ?d))
        :effect (and (at ?r ?d) (empty ?c) (not (at ?r ?c)) (not (empty ?d)))))"""
    cells = [f"c{n}" for n in range(length)] + ["bay"]
    pairs = [(f"c{n}", f"c{n + 1}") for n in range(length - 1)] + [("bay", f"c{length // 2}")]
    following = [f"(next {a} {b}) (next {b} {a})" for a, b in pairs]
    names = [f"r{n}" for n in range(robots)]
    at = [f"(at {name} c{n})" for n, name in enumerate(names)]
    taken = {f"c{n}" for n in range(robots)}
    init = [*following, *at, *(f"(empty {c})" for c in cells if c not in taken)]
    goal = [f"(at {name} c{length - 1 - n})" for n, name in enumerate(reversed(names))]
    return domain, _problem("crowd", [*cells, *names], init, goal)


def _loads(parcels: int) -> Texts:
    """Trucks that carry one parcel at a time between many places: easy, but wide."""
    domain = """(define (domain loads) (:requirements :strips)
      (:predicates (truck ?t) (parcel ?p) (place ?x) (at ?o ?x) (in ?p ?t) (void ?t))
      (:action drive :parameters (?t ?x ?y)
        :precondition (and (truck ?t) (place ?x) (place ?y) (at ?t ?x))
        :effect (and (at ?t ?y) (not (at ?t ?x))))
      (:action load :parameters (?p ?t ?x)
        :precondition (and (parcel ?p) (truck ?t) (place ?x) (at ?p ?x) (at ?t ?x) (void ?t))
        :effect (and (in ?p ?t) (not (at ?p ?x)) (not (void ?t))))
      (:action unload :parameters (?p ?t ?x)
        :precondition (and (parcel ?p) (truck ?t) (place ?x) (in ?p ?t) (at ?t ?x))
        :effect (and (at ?p ?x) (void ?t) (not (in ?p ?t)))))"""
    chance = random.Random(parcels)
    places = [f"x{n}" for n in range(parcels)]
    trucks = [f"t{n}" for n in range(max(1, parcels // 4))]
    goods = [f"p{n}" for n in range(parcels)]
    init = [f"(place {x})" for x in places]
    init += [f"(truck {t}) (void {t}) (at {t} {chance.choice(places)})" for t in trucks]
    init += [f"(parcel {p}) (at {p} {chance.choice(places)})" for p in goods]
    goal = [f"(at {p} {chance.choice(places)})" for p in goods]
    return domain, _problem("loads", [*places, *trucks, *goods], init, goal)


def _arity(objects: int) -> Texts:
    """An action of six parameters: too many ways to be bound."""
    parameters = " ".join(f"?p{n}" for n in range(6))
    known = " ".join(f"(thing ?p{n})" for n in range(6))
    domain = f"""(define (domain arity) (:requirements :strips)
      (:predicates (thing ?x) (tied {parameters}))
      (:action tie :parameters ({parameters}) :precondition (and {known})
        :effect (tied {parameters})))"""
    names = [f"o{n}" for n in range(objects)]
    goal = [f"(tied {' '.join([names[-1]] * 6)}) (tied {' '.join([names[0]] * 6)})"]
    return domain, _problem("arity", names, [f"(thing {name})" for name in names], goal)


def _lights(width: int) -> Texts:
    """Lights Out: each press changes five, by conditional effects."""
    cells = [(x, y) for y in range(width) for x in range(width)]
    actions = []
    for x, y in cells:
        near = [(x, y), (x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        flips = " ".join(
            f"(when (lit l{a}-{b}) (not (lit l{a}-{b}))) (when (not (lit l{a}-{b})) (lit l{a}-{b}))"
            for a, b in near
            if (a, b) in cells
        )
        actions.append(f"(:action press{x}-{y} :parameters () :effect (and {flips}))")
    names = [f"l{x}-{y}" for x, y in cells]
    head = "(define (domain lights) (:requirements :adl)"
    constants = f"(:constants {' '.join(names)})"
    domain = f"{head} {constants} (:predicates (lit ?l)) {' '.join(actions)})"
    chance = random.Random(width)
    lit = [f"(lit {name})" for name in names if chance.random() < 0.5] or [f"(lit {names[0]})"]
    return domain, _problem("lights", [], lit, [f"(not (lit {name}))" for name in names])


def _reach(nodes: int) -> Texts:
    """Cut a graph until one node cannot reach another: a derived predicate, negated."""
    domain = """(define (domain reach) (:requirements :adl :derived-predicates)
      (:predicates (edge ?a ?b) (path ?a ?b) (cuttable ?a ?b) (spare ?k))
      (:derived (path ?a ?b)
        (or (edge ?a ?b) (exists (?m) (and (edge ?a ?m) (path ?m ?b)))))
      (:action cut :parameters (?a ?b ?k) :precondition (and (cuttable ?a ?b) (spare ?k))
        :effect (and (not (edge ?a ?b)) (not (spare ?k)))))"""
    chance = random.Random(nodes)
    names = [f"n{n}" for n in range(nodes)]
    pairs = [(a, b) for a in names for b in names if a != b and chance.random() < 3 / nodes]
    init = [f"(edge {a} {b}) (cuttable {a} {b})" for a, b in pairs]
    spares = [f"k{n}" for n in range(max(2, nodes // 3))]
    init += [f"(spare {k})" for k in spares]
    goal = [f"(not (path {names[0]} {names[-1]}))"]
    return domain, _problem("reach", [*names, *spares], init, goal)


def _problem(name: str, objects: Sequence[str], init: Sequence[str], goal: Sequence[str]) -> str:
    things = f"(:objects {' '.join(objects)})" if objects else ""
    facts, wanted = " ".join(init), " ".join(goal)
    head = f"(define (problem p) (:domain {name})"
    return f"{head} {things} (:init {facts}) (:goal (and {wanted})))"


FAMILIES: Mapping[str, tuple[Callable[[int], Texts], Sequence[int]]] = {
    "towers of Hanoi": (_hanoi, (3, 6, 9, 12, 15, 20)),
    "a binary counter": (_counter, (4, 8, 12, 16, 20, 40)),
    "sliding tiles": (_tiles, (2, 3, 4, 5, 6, 8)),
    "sliding tiles, twisted": (_twisted_tiles, (2, 3, 4, 5, 6, 8)),
    "pigeons and holes": (_pigeons, (2, 4, 6, 8, 12, 20)),
    "robots in a corridor": (_crowd, (2, 4, 6, 8, 12, 20)),
    "loads and trucks": (_loads, (4, 8, 16, 24, 32, 64)),
    "six parameters": (_arity, (2, 4, 6, 7, 12, 40)),
    "lights out": (_lights, (2, 3, 4, 5, 7, 10)),
    "cutting graphs": (_reach, (4, 8, 12, 16, 24, 40)),
}
"""Family → what makes a problem of a size, and the sizes."""
