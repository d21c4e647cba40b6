"""A payload to try things with: a light that shines for people and greets them."""

from __future__ import annotations

BEACON = '''"""A light that shines for people and greets them."""

from nondum.sdk import Fragment, Header, Label, Output, Phrase, Scalar, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain beacon)
  (:predicates (lit ?h - host) (greeted ?c - class ?h - host))
  (:action shine
    :parameters (?u - light ?o - scalar ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (lit ?h)))
  (:action greet
    :parameters (?u - light ?c - class ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (lit ?h))
    :effect (greeted ?c ?h)))
"""
PROBLEM = "(define (problem beacon) (:domain beacon) (:objects person - class))"

@hookimpl
def units():
    return [Unit("lamp", "light", outputs=(Output("brightness", "scalar"),))]

@hookimpl
def fragments():
    return [Fragment("domain.pddl", DOMAIN), Fragment("problem.pddl", PROBLEM)]

@hookimpl
def phrases():
    return [Phrase("shine [for {words:text}]", "(lit self)", kind="maintain")]

@hookimpl
def labels():
    return [Label("person", "people")]

@hookimpl
def start(ctx):
    ctx.log.info("polished")
    print("plain words")

@behaviour("shine", action="(shine ?u - light ?o - scalar ?h - host)", lasting=True)
async def shine(ctx, u, o, h):
    """Shine until halted."""
    await ctx.established()
    seq = 0
    while True:
        seq += 1
        ctx.output(o).send(Scalar(Header(frame_id=u, seq=seq), 0.5, "1"))
        await ctx.sleep(0.01)

@behaviour(
    "greet", action="(greet ?u - light ?c - class ?h - host)", phrase="greet {c}"
)
async def greet(ctx, u, c, h):
    """Greet once."""
    ctx.know("greeted", c, h)
'''
BEACON_ID = "org.example.beacon"
HOST = "panther"
"""On which its unit and its stream are called as follows."""
LAMP = f"{HOST}__beacon__lamp"
BRIGHTNESS = f"{HOST}__beacon__brightness"
