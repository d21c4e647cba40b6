"""Plugins of authors who share the core's words and nothing else; each text is its author's own."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from nondum.planning.merge.contribution import Contribution
from nondum.sdk.description import Behaviour, Fragment, Output, PluginDescription, Unit

HOST = "rover"

_STREAM = """
; {name}: frames from whatever it is pointed at.
(define (domain {name})
  (:types {name}-mode - object)
  (:constants {name}-fast {name}-sharp - {name}-mode)
  (:predicates (set-to-{name} ?u - unit ?m - {name}-mode) (warm-{name} ?u - unit))
  (:action stream
    :parameters (?u - camera ?o - image ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h)))
  (:action set-up
    :parameters (?u - camera ?m - {name}-mode)
    :precondition (and (ready ?u) (idle ?u) (or (warm-{name} ?u) (idle ?u)))
    :effect (and (set-to-{name} ?u ?m)
                 (forall (?n - {name}-mode)
                   (when (and (set-to-{name} ?u ?n) (not (= ?n ?m)))
                     (not (set-to-{name} ?u ?n)))))))
"""
_DETECT = """
; {name}: finds what its model was trained on.
(define (domain {name})
  (:types {name}-model - object)
  (:constants person dog{number} - class {name}-small {name}-large - {name}-model)
  (:predicates (loaded-{name} ?u - unit ?m - {name}-model))
  (:action detect
    :parameters (?u - detector ?i - image ?o - detections ?h - host ?c - class)
    :precondition (and (ready ?u) (recognises ?u ?c) (flowing ?i) (from ?i ?h)
                       (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (shows ?o ?c)
                 (increase (total-cost) {cost})))
  (:action load
    :parameters (?u - detector ?m - {name}-model)
    :precondition (and (ready ?u) (not (loaded-{name} ?u ?m)))
    :effect (loaded-{name} ?u ?m)))
"""
_DETECT_INIT = """
(define (problem {name})
  (:domain {name})
  (:init (recognises hog person) (recognises hog dog{number})))
"""
_TRACK = """
; {name}: keeps one of those detected in the middle.
(define (domain {name})
  (:action track
    :parameters (?u - tracker ?d - detections ?o - twist ?h - host ?c - class)
    :precondition (and (ready ?u) (flowing ?d) (from ?d ?h) (shows ?d ?c) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (steers ?o ?h ?c)))
  (:action watch
    :parameters (?u - tracker ?d - detections ?h - host ?c - class)
    :precondition (and (ready ?u) (flowing ?d) (from ?d ?h) (shows ?d ?c))
    :effect (found ?c ?h)))
"""
_DRIVE = """
; {name}: obeys a twist for as long as it is fresh.
(define (domain {name})
  (:predicates (charged-{name} ?u - unit) (parked-{name} ?u - unit))
  (:action drive
    :parameters (?u - base ?s - twist ?h - host ?c - class)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (steers ?s ?h ?c))
    :effect (and (not (idle ?u)) (following ?h ?c)))
  (:action park
    :parameters (?u - base)
    :precondition (and (ready ?u) (idle ?u) (not (parked-{name} ?u)))
    :effect (and (parked-{name} ?u) (charged-{name} ?u))))
"""
_SURVEY = """
; {name}: a map of places, and what was seen in them.
(define (domain {name})
  (:types {name}-zone - place)
  (:constants {zones} - {name}-zone)
  (:functions (way-{name} ?a ?b - {name}-zone))
  (:predicates (next-{name} ?a ?b - {name}-zone) (seen-{name} ?r - {name}-zone)
               (surveyed-{name} ?h - host))
  (:derived (surveyed-{name} ?h - host) (forall (?r - {name}-zone) (seen-{name} ?r)))
  (:action look
    :parameters (?u - sensor ?a ?b - {name}-zone ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (next-{name} ?a ?b) (seen-{name} ?a))
    :effect (and (seen-{name} ?b) (increase (total-cost) (way-{name} ?a ?b)))))
"""
_SURVEY_INIT = """
(define (problem {name})
  (:domain {name})
  (:init (seen-{name} {name}-r0) {ways}))
"""

_HANDLE = """
; {name}: takes things and puts them elsewhere.
(define (domain {name})
  (:types {name}-item - object {name}-shelf - place)
  (:constants {items} - {name}-item {name}-left {name}-right - {name}-shelf)
  (:predicates (lies-{name} ?i - {name}-item ?s - {name}-shelf)
               (holds-{name} ?u - unit ?i - {name}-item) (empty-{name} ?u - unit))
  (:action take
    :parameters (?u - arm ?i - {name}-item ?s - {name}-shelf)
    :precondition (and (ready ?u) (idle ?u) (empty-{name} ?u) (lies-{name} ?i ?s))
    :effect (and (not (lies-{name} ?i ?s)) (not (empty-{name} ?u)) (holds-{name} ?u ?i)))
  (:action put
    :parameters (?u - arm ?i - {name}-item ?s - {name}-shelf)
    :precondition (and (ready ?u) (idle ?u) (holds-{name} ?u ?i))
    :effect (and (lies-{name} ?i ?s) (empty-{name} ?u) (not (holds-{name} ?u ?i)))))
"""
_HANDLE_INIT = """
(define (problem {name}) (:domain {name}) (:init (empty-{name} arm) {lying}))
"""
_SENSE = """
; {name}: tells the direction of what it senses.
(define (domain {name})
  (:constants source{number} - target)
  (:action localise
    :parameters (?u - sensor ?t - target ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (senses ?u ?t))
    :effect (bearing-known ?t ?h)))
"""
_SENSE_INIT = """
(define (problem {name}) (:domain {name}) (:init (senses probe source{number})))
"""
_POINT = """
; {name}: keeps a beam on a bearing.
(define (domain {name})
  (:action point
    :parameters (?u - pointer ?t - target ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (bearing-known ?t ?h))
    :effect (and (not (idle ?u)) (pointing ?h ?t))))
"""
_REPORT = """
; {name}: says what was found.
(define (domain {name})
  (:action report
    :parameters (?u - speaker ?c - class ?h - host)
    :precondition (and (ready ?u) (found ?c ?h))
    :effect (reported ?c ?h)))
"""
_LIGHT = """
; {name}: lamps, each of which toggles.
(define (domain {name})
  (:types {name}-lamp - object)
  (:constants {name}-red {name}-green - {name}-lamp)
  (:predicates (lit-{name} ?l - {name}-lamp) (bright-{name} ?h - host))
  (:derived (bright-{name} ?h - host) (exists (?l - {name}-lamp) (lit-{name} ?l)))
  (:action toggle
    :parameters (?u - light ?l - {name}-lamp ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (and (when (lit-{name} ?l) (not (lit-{name} ?l)))
                 (when (not (lit-{name} ?l)) (lit-{name} ?l)))))
"""

_DETECTION = "(detect ?u - detector ?i - image ?o - detections ?h - host ?c - class)"
_STREAMING = Behaviour("stream", "(stream ?u - camera ?o - image ?h - host)", lasting=True)
_TRACKING = "(track ?u - tracker ?d - detections ?o - twist ?h - host ?c - class)"
_DRIVING = "(drive ?u - base ?s - twist ?h - host ?c - class)"
ZONES = 6


def _camera(number: int) -> PluginDescription:
    name = f"camera{number}"
    return PluginDescription(
        name,
        "1.0",
        behaviours=(_STREAMING, Behaviour("set-up", f"(set-up ?u - camera ?m - {name}-mode)")),
        fragments=(Fragment("domain.pddl", _STREAM.format(name=name)),),
        units=(Unit("camera", "camera", outputs=(Output("frames", "image"),)),),
    )


def _detector(number: int) -> PluginDescription:
    name = f"detector{number}"
    words = {"name": name, "number": number, "cost": 1 + number % 4}
    return PluginDescription(
        name,
        "2.1",
        behaviours=(
            Behaviour("detect", _DETECTION, lasting=True),
            Behaviour("load", f"(load ?u - detector ?m - {name}-model)"),
        ),
        fragments=(
            Fragment("domain.pddl", _DETECT.format(**words)),
            Fragment("problem.pddl", _DETECT_INIT.format(**words)),
        ),
        units=(Unit("hog", "detector", outputs=(Output("found", "detections"),)),),
    )


def _tracker(number: int) -> PluginDescription:
    name = f"tracker{number}"
    return PluginDescription(
        name,
        "0.3",
        behaviours=(
            Behaviour("track", _TRACKING, lasting=True),
            Behaviour("watch", "(watch ?u - tracker ?d - detections ?h - host ?c - class)"),
        ),
        fragments=(Fragment("domain.pddl", _TRACK.format(name=name)),),
        units=(Unit("tracker", "tracker", outputs=(Output("steering", "twist"),)),),
    )


def _base(number: int) -> PluginDescription:
    name = f"base{number}"
    return PluginDescription(
        name,
        "1.1",
        behaviours=(
            Behaviour("drive", _DRIVING, lasting=True),
            Behaviour("park", "(park ?u - base)"),
        ),
        fragments=(Fragment("domain.pddl", _DRIVE.format(name=name)),),
        units=(Unit("wheels", "base"),),
    )


def _surveyor(number: int) -> PluginDescription:
    name = f"surveyor{number}"
    zones = [f"{name}-r{zone}" for zone in range(ZONES)]
    pairs = list(pairwise(zones))
    ways = " ".join(
        f"(next-{name} {a} {b}) (= (way-{name} {a} {b}) {1 + at})"
        for at, (a, b) in enumerate(pairs)
    )
    return PluginDescription(
        name,
        "0.9",
        behaviours=(Behaviour("look", f"(look ?u - sensor ?a ?b - {name}-zone ?h - host)"),),
        fragments=(
            Fragment("domain.pddl", _SURVEY.format(name=name, zones=" ".join(zones))),
            Fragment("problem.pddl", _SURVEY_INIT.format(name=name, ways=ways)),
        ),
        units=(Unit("lidar", "sensor"),),
    )


def _handler(number: int) -> PluginDescription:
    name = f"arm{number}"
    items = [f"{name}-i{item}" for item in range(4)]
    lying = " ".join(f"(lies-{name} {item} {name}-left)" for item in items)
    return PluginDescription(
        name,
        "1.4",
        behaviours=(
            Behaviour("take", f"(take ?u - arm ?i - {name}-item ?s - {name}-shelf)"),
            Behaviour("put", f"(put ?u - arm ?i - {name}-item ?s - {name}-shelf)"),
        ),
        fragments=(
            Fragment("domain.pddl", _HANDLE.format(name=name, items=" ".join(items))),
            Fragment("problem.pddl", _HANDLE_INIT.format(name=name, lying=lying)),
        ),
        units=(Unit("arm", "arm"),),
    )


def _simple(
    kind: str, unit: str, type_: str, behaviour: Behaviour, *texts: str
) -> Callable[[int], PluginDescription]:
    def make(number: int) -> PluginDescription:
        name = f"{kind}{number}"
        return PluginDescription(
            name,
            "1.0",
            behaviours=(behaviour,),
            fragments=tuple(
                Fragment(f"{at}.pddl", text.format(name=name, number=number))
                for at, text in enumerate(texts)
            ),
            units=(Unit(unit, type_),),
        )

    return make


def _lights(number: int) -> PluginDescription:
    name = f"light{number}"
    toggle = Behaviour("toggle", f"(toggle ?u - light ?l - {name}-lamp ?h - host)")
    return _simple("light", "lamps", "light", toggle, _LIGHT)(number)


_LOCALISING = Behaviour("localise", "(localise ?u - sensor ?t - target ?h - host)")
_POINTING = Behaviour("point", "(point ?u - pointer ?t - target ?h - host)", lasting=True)
_REPORTING = Behaviour("report", "(report ?u - speaker ?c - class ?h - host)")

KINDS = (
    _camera,
    _detector,
    _tracker,
    _base,
    _surveyor,
    _handler,
    _simple("probe", "probe", "sensor", _LOCALISING, _SENSE, _SENSE_INIT),
    _simple("pointer", "beam", "pointer", _POINTING, _POINT),
    _simple("speaker", "voice", "speaker", _REPORTING, _REPORT),
    _lights,
)


def stranger(number: int, batch: int) -> Contribution:
    """Number `number` of a batch; no two batches share a text."""
    made = KINDS[number % len(KINDS)](1000 * batch + number)
    return Contribution.from_description(made, host=HOST, component=made.name, rank=number)


def text_bytes(contribution: Contribution) -> int:
    """How much its author wrote."""
    return sum(len(fragment.text.encode()) for fragment in contribution.fragments)
