"""Ten plugins of ten authors, who share nothing but the core's words."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import entry_points

from nondum.planning.ground.ground import ground
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.domain import Merged
from nondum.planning.merge.goal import parse_goal
from nondum.planning.merge.merge import merge
from nondum.sdk.description import Behaviour, Fragment, Output, PluginDescription, Unit
from nondum.sdk.planner import GroundTask, Planner

ROVER = "rover"

CAMERA_FRAGMENT = """
(define (domain camera)
  (:action stream
    :parameters (?u - camera ?o - image ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h))))
"""
CAMERA_BEHAVIOUR = Behaviour("stream", "(stream ?u - camera ?o - image ?h - host)", lasting=True)
CAMERA_UNIT = Unit("camera", "camera", outputs=(Output("frames", "image"),))


def camera(name: str, version: str = "1.0") -> PluginDescription:
    """A plugin with one camera."""
    return PluginDescription(
        name,
        version,
        behaviours=(CAMERA_BEHAVIOUR,),
        fragments=(Fragment("domain.pddl", CAMERA_FRAGMENT),),
        units=(CAMERA_UNIT,),
    )


RECORDED_CAMERA = camera("recorded-camera")
THERMAL_CAMERA = camera("thermal-camera")

PEOPLE_DETECTOR = PluginDescription(
    "people-detector",
    "2.1",
    behaviours=(
        Behaviour(
            "detect",
            "(detect ?u - detector ?i - image ?o - detections ?h - host ?c - class)",
            lasting=True,
        ),
    ),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain people-detector)
              (:constants person - class)
              (:action detect
                :parameters (?u - detector ?i - image ?o - detections ?h - host ?c - class)
                :precondition (and (ready ?u) (recognises ?u ?c) (flowing ?i) (from ?i ?h)
                                   (output ?u ?o) (free ?o))
                :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (shows ?o ?c))))
            """,
        ),
        Fragment(
            "problem.pddl",
            "(define (problem hog) (:domain people-detector) (:init (recognises hog person)))",
        ),
    ),
    units=(Unit("hog", "detector", outputs=(Output("found", "detections"),)),),
)

VISUAL_TRACKER = PluginDescription(
    "visual-tracker",
    "0.3",
    behaviours=(
        Behaviour(
            "track",
            "(track ?u - tracker ?d - detections ?o - twist ?h - host ?c - class)",
            lasting=True,
        ),
        Behaviour("watch", "(watch ?u - tracker ?d - detections ?h - host ?c - class)"),
    ),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain visual-tracker)
              (:action track
                :parameters (?u - tracker ?d - detections ?o - twist ?h - host ?c - class)
                :precondition (and (ready ?u) (flowing ?d) (from ?d ?h) (shows ?d ?c)
                                   (output ?u ?o) (free ?o))
                :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (steers ?o ?h ?c)))
              (:action watch
                :parameters (?u - tracker ?d - detections ?h - host ?c - class)
                :precondition (and (ready ?u) (flowing ?d) (from ?d ?h) (shows ?d ?c))
                :effect (found ?c ?h)))
            """,
        ),
    ),
    units=(Unit("tracker", "tracker", outputs=(Output("steering", "twist"),)),),
)

MOBILE_BASE = PluginDescription(
    "mobile-base",
    "1.1",
    behaviours=(
        Behaviour("drive", "(drive ?u - base ?s - twist ?h - host ?c - class)", lasting=True),
    ),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain mobile-base)
              (:action drive
                :parameters (?u - base ?s - twist ?h - host ?c - class)
                :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (steers ?s ?h ?c))
                :effect (and (not (idle ?u)) (following ?h ?c))))
            """,
        ),
    ),
    units=(Unit("wheels", "base"),),
)

COMPTON_CAMERA = PluginDescription(
    "compton-camera",
    "0.9",
    behaviours=(Behaviour("localise", "(localise ?u - sensor ?t - target ?h - host)"),),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain compton-camera)
              (:constants radiation-source - target)
              (:action localise
                :parameters (?u - sensor ?t - target ?h - host)
                :precondition (and (ready ?u) (on ?u ?h) (senses ?u ?t))
                :effect (bearing-known ?t ?h)))
            """,
        ),
        Fragment(
            "problem.pddl", "(define (problem compton) (:init (senses crystal radiation-source)))"
        ),
    ),
    units=(Unit("crystal", "sensor"),),
)

PAN_TILT_UNIT = PluginDescription(
    "pan-tilt-unit",
    "4.6",
    behaviours=(Behaviour("point", "(point ?u - pointer ?t - target ?h - host)", lasting=True),),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain pan-tilt-unit)
              (:action point
                :parameters (?u - pointer ?t - target ?h - host)
                :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (bearing-known ?t ?h))
                :effect (and (not (idle ?u)) (pointing ?h ?t))))
            """,
        ),
    ),
    units=(Unit("head", "pointer"),),
)

SPEAKER = PluginDescription(
    "speaker",
    "1.0",
    behaviours=(Behaviour("report", "(report ?u - speaker ?c - class ?h - host)"),),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain speaker)
              (:action report
                :parameters (?u - speaker ?c - class ?h - host)
                :precondition (and (ready ?u) (found ?c ?h))
                :effect (reported ?c ?h)))
            """,
        ),
    ),
    units=(Unit("voice", "speaker"),),
)

LAMP = PluginDescription(
    "lamp",
    "1.0",
    behaviours=(Behaviour("shine", "(shine ?u - light)", lasting=True),),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain lamp)
              (:predicates (lit ?u - light))
              (:action shine :parameters (?u - light)
                :precondition (and (ready ?u) (idle ?u)) :effect (and (not (idle ?u)) (lit ?u))))
            """,
        ),
    ),
    units=(Unit("led", "light"),),
)

BEACON = PluginDescription(
    "beacon",
    "1.0",
    behaviours=(
        Behaviour("shine", "(shine ?u - light)", lasting=True),
        Behaviour("flash", "(flash ?u - light ?c - class ?h - host)", lasting=True),
    ),
    fragments=(
        Fragment(
            "domain.pddl",
            """
            (define (domain beacon)
              (:constants person - class)
              (:predicates (lit ?u - light))
              (:action shine :parameters (?u - light)
                :precondition (and (ready ?u) (idle ?u)) :effect (and (not (idle ?u)) (lit ?u)))
              (:action flash :parameters (?u - light ?c - class ?h - host)
                :precondition (and (ready ?u) (idle ?u) (on ?u ?h))
                :effect (and (not (idle ?u)) (reported ?c ?h))))
            """,
        ),
    ),
    units=(Unit("led", "light"),),
)
"""A unit that can do one of two things. It is not among the strangers."""

STRANGERS = (
    RECORDED_CAMERA,
    PEOPLE_DETECTOR,
    VISUAL_TRACKER,
    MOBILE_BASE,
    COMPTON_CAMERA,
    PAN_TILT_UNIT,
    SPEAKER,
    LAMP,
    THERMAL_CAMERA,
    camera("stereo-camera"),
)


def component(plugin: PluginDescription, host: str = ROVER, rank: int = 0) -> Contribution:
    """The plugin as a component of the same name."""
    return Contribution.from_description(plugin, host=host, component=plugin.name, rank=rank)


def components(plugins: Iterable[PluginDescription], host: str = ROVER) -> list[Contribution]:
    """The plugins as components of one host."""
    return [component(plugin, host) for plugin in plugins]


def at_rest(contributions: Iterable[Contribution], merged: Merged) -> set[str]:
    """What is true when nothing runs."""
    facts = {f"self {merged.self_host}", *merged.init}
    return facts.union(*(contribution.body_facts() for contribution in contributions))


def task(contributions: Iterable[Contribution], goal: str) -> GroundTask:
    """The task of reaching a goal on the rover, with nothing running."""
    present = list(contributions)
    merged = merge(present, ROVER)
    assert not merged.quarantined, merged.quarantined
    return ground(merged, at_rest(present, merged), parse_goal(goal, merged).expr)


def planner() -> Planner:
    """pyperplan's search, found as hosts find it."""
    [found] = entry_points(group="nondum.planners", name="pyperplan")
    made = found.load()()
    assert isinstance(made, Planner)
    return made
