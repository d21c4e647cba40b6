"""Cries the hours, and knows the last one that it cried."""

from __future__ import annotations

from nondum.sdk import (
    Context,
    Fragment,
    Header,
    Output,
    Phrase,
    Text,
    Unit,
    behaviour,
    hookimpl,
)

DOMAIN = """
(define (domain crier)
  (:predicates (cried ?h - host) (hour ?u - unit))
  (:valued hour)
  (:action cry
    :parameters (?u - speaker ?o - text ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (cried ?h))))
"""


@hookimpl
def units() -> tuple[Unit, ...]:
    return (Unit("mouth", "speaker", outputs=(Output("voice", "text"),)),)


@hookimpl
def fragments() -> tuple[Fragment, ...]:
    return (Fragment("crier.pddl", DOMAIN),)


@hookimpl
def phrases() -> tuple[Phrase, ...]:
    return (Phrase("cry the hours", "(cried self)", kind="maintain"),)


@behaviour("cry", action="(cry ?u - speaker ?o - text ?h - host)", lasting=True)
async def cry(ctx: Context, u: str, o: str, h: str) -> None:
    """Cry until halted."""
    voice = ctx.output(o)
    hour = 0
    while True:
        hour = hour % 12 + 1
        voice.send(Text(Header(), f"{hour} o'clock"))
        if hour == 1:
            ctx.know("hour", "mouth", value=Text(Header(), "one"))
            await ctx.established()
        await ctx.sleep(float(ctx.settings["hour_s"]))
