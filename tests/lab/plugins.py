"""Small plugins for the lab: each does one thing, and says in PDDL what that is for."""

from __future__ import annotations

from typing import Any

from tests.payloads import Part

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
    await words.next(timeout_s=5.0)
    await ctx.established()
    async for _ in words:
        pass
'''


def talker(id: str = "talker", **options: Any) -> Part:
    """Speaks on its stream `voice`, lasting; two of them are alternatives."""
    return Part(id, TALKER, **options)


def scribe(id: str = "scribe", **options: Any) -> Part:
    """Makes `(written <host>)` true while it reads what is spoken."""
    return Part(id, SCRIBE, **options)
