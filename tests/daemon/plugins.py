"""Small plugins for the lab: each does one thing, and says in PDDL what that is for."""

from __future__ import annotations

from typing import Any

from tests.kit.payloads import Part

TALKER = '''"""Talks on and on."""
from nondum.sdk import Fragment, Header, Output, Text, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain talker)
  (:action talk
    :parameters (?u - speaker ?o - text ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h))))
"""

@hookimpl
def units():
    return [Unit("mouth", "speaker", outputs=(Output("voice", "text"),))]

@hookimpl
def fragments():
    return [Fragment("talker.pddl", DOMAIN)]

@behaviour("talk", action="(talk ?u - speaker ?o - text ?h - host)", lasting=True)
async def talk(ctx, u, o, h):
    voice = ctx.output(o)
    voice.send(Text(Header(), "hello"))
    await ctx.established()
    while True:
        await ctx.sleep(0.1)
        voice.send(Text(Header(), "hello"))
'''

SCRIBE = '''"""Writes down what it hears."""
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain scribe)
  (:predicates (written ?h - host))
  (:action write
    :parameters (?u - sensor ?s - text ?h - host)
    :precondition (and (ready ?u) (flowing ?s) (from ?s ?h))
    :effect (written ?h)))
"""

@hookimpl
def units():
    return [Unit("pen", "sensor")]

@hookimpl
def fragments():
    return [Fragment("scribe.pddl", DOMAIN)]

@behaviour("write", action="(write ?u - sensor ?s - text ?h - host)", lasting=True)
async def write(ctx, u, s, h):
    words = ctx.input(s)
    await words.next(timeout_s=60.0)
    await ctx.established()
    async for _ in words:
        pass
'''


WATCHER = '''"""Keeps its eye on whatever speaks, without a pause."""
from nondum.sdk import Bearing, Fragment, Header, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain watcher)
  (:predicates (watched ?h - host))
  (:action watch
    :parameters (?u - sensor ?m - speaker ?s - text ?h - host)
    :precondition (and (ready ?u) (output ?m ?s) (flowing ?s))
    :effect (watched ?h)))
"""

@hookimpl
def units():
    return [Unit("eye", "sensor")]

@hookimpl
def fragments():
    return [Fragment("watcher.pddl", DOMAIN)]

@behaviour("watch", action="(watch ?u - sensor ?m - speaker ?s - text ?h - host)", lasting=True)
async def watch(ctx, u, m, s, h):
    ahead = Bearing(Header(frame_id=m), (1.0, 0.0, 0.0), 0.1)
    ctx.transform(ahead, to=h)
    await ctx.established()
    while True:
        ctx.transform(ahead, to=h)
        await ctx.sleep(0)
'''


def talker(id: str = "talker", **options: Any) -> Part:
    """Speaks on its stream `voice`, lasting; two of them are alternatives."""
    return Part(id, TALKER, **options)


def scribe(id: str = "scribe", **options: Any) -> Part:
    """Makes `(written <host>)` true while it reads what is spoken."""
    return Part(id, SCRIBE, **options)


def watcher(id: str = "watcher") -> Part:
    """Makes `(watched <host>)` true as long as it knows where a speaker is mounted."""
    return Part(id, WATCHER)


GAUGE = '''"""Listens to a gauge for as long as it is there."""
import os, select

from nondum.sdk import BehaviourFailed, DeviceNeed, Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain gauge)
  (:predicates (measured ?h - host))
  (:action measure
    :parameters (?u - sensor ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (measured ?h)))
"""

@hookimpl
def units():
    return [Unit("gauge", "sensor")]

@hookimpl
def devices():
    return [DeviceNeed("gauge", {"ID_MODEL": "Gauge"})]

@hookimpl
def fragments():
    return [Fragment("gauge.pddl", DOMAIN)]

@behaviour("measure", action="(measure ?u - sensor ?h - host)", lasting=True)
async def measure(ctx, u, h):
    line = select.poll()
    port = os.open(ctx.device("gauge").node, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    line.register(port, 0)
    try:
        await ctx.established()
        while not line.poll(0):  # hang-ups are always told
            await ctx.sleep(0.05)
    finally:
        os.close(port)
    raise BehaviourFailed("nothing is heard any more", code="GAUGE_GONE")
'''


def gauge(id: str = "gauge") -> Part:
    """Makes `(measured <host>)` true while its device is there."""
    need = '[[component.device]]\nname = "gauge"\nmatch = { ID_MODEL = "Gauge" }\n'
    return Part(id, GAUGE, manifest=need)


ARM = '''"""Raises and waves an arm."""
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain arm)
  (:predicates (raised ?h - host) (waved ?h - host))
  (:action lift
    :parameters (?u - arm ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u))
    :effect (and (not (idle ?u)) (raised ?h)))
  (:action wave
    :parameters (?u - arm ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u))
    :effect (and (not (idle ?u)) (waved ?h))))
"""

@hookimpl
def units():
    return [Unit("arm", "arm")]

@hookimpl
def fragments():
    return [Fragment("arm.pddl", DOMAIN)]

@behaviour("lift", action="(lift ?u - arm ?h - host)", lasting=True)
async def lift(ctx, u, h):
    await ctx.established()
    await ctx.sleep(3600)

@behaviour("wave", action="(wave ?u - arm ?h - host)", lasting=True)
async def wave(ctx, u, h):
    await ctx.established()
    await ctx.sleep(3600)
'''

COMPASS = '''"""Sees everything straight ahead of itself."""
from nondum.sdk import Bearing, Fragment, Header, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain compass)
  (:constants north south - target)
  (:action sight
    :parameters (?u - sensor ?t - target ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (bearing-known ?t ?h)))
"""

@hookimpl
def units():
    return [Unit("needle", "sensor")]

@hookimpl
def fragments():
    return [Fragment("compass.pddl", DOMAIN)]

@behaviour("sight", action="(sight ?u - sensor ?t - target ?h - host)")
async def sight(ctx, u, t, h):
    ahead = Bearing(Header(frame_id=u), (1.0, 0.0, 0.0), 0.01)
    ctx.know("bearing-known", t, h, value=ctx.transform(ahead, to=h))
'''


def arm(id: str = "arm", *, is_rude: bool = False) -> Part:
    """Makes `(raised <host>)` or `(waved <host>)` true; a rude one does not ask who uses it."""
    source = ARM.replace("(not (idle ?u)) ", "").replace(" (idle ?u)", "") if is_rude else ARM
    return Part(id, source)


def compass(id: str = "compass") -> Part:
    """Knows the bearing of `north` and `south` in the body's frame: wherever its unit looks."""
    return Part(id, COMPASS)


LAMPS = '''"""Toggles the lamps of rooms that other people's payloads may name."""
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain lamps)
  (:types room - place)
  (:predicates (lit ?r - room) (bright ?h - host))
  (:derived (bright ?h - host) (and (self ?h) (forall (?r - room) (lit ?r))))
  (:action toggle
    :parameters (?u - light ?r - room ?h - host)
    :precondition (and (on ?u ?h) (or (ready ?u) (lit ?r)))
    :effect (and (when (lit ?r) (not (lit ?r))) (when (not (lit ?r)) (lit ?r)))))
"""
PROBLEM = "(define (problem lamps) (:domain lamps) (:objects hall kitchen - room))"

@hookimpl
def units():
    return [Unit("switch", "light")]

@hookimpl
def fragments():
    return [Fragment("lamps.pddl", DOMAIN), Fragment("rooms.pddl", PROBLEM)]

@behaviour("toggle", action="(toggle ?u - light ?r - room ?h - host)")
async def toggle(ctx, u, r, h):
    ctx.log.info("toggled %s", r)
'''

ATTIC = '''"""Knows of one room more."""
from nondum.sdk import Fragment, hookimpl

DOMAIN = "(define (domain attic) (:types room - place))"
PROBLEM = "(define (problem attic) (:domain attic) (:objects attic - room))"

@hookimpl
def fragments():
    return [Fragment("words.pddl", DOMAIN), Fragment("attic.pddl", PROBLEM)]
'''


def lamps(id: str = "lamps") -> Part:
    """Toggles lamps: `or`, `when`, `forall` and a derived predicate, in one fragment."""
    return Part(id, LAMPS)


def attic(id: str = "attic") -> Part:
    """Brings a room, and nothing that acts."""
    return Part(id, ATTIC)
