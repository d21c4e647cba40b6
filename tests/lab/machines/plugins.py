"""Small plugins for scenarios: each has one behaviour, and its author writes what that does."""

from __future__ import annotations

from tests.payloads import Part

SOURCE = '''"""Does one thing when it is asked to."""
import asyncio, os, subprocess, sys, time
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain {id})
  (:predicates ({id}-done ?h - host))
  (:action do-{id}
    :parameters (?u - sensor ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect ({id}-done ?h)))
"""

@hookimpl
def units():
    return [Unit("it", "sensor")]

@hookimpl
def fragments():
    return [Fragment("{id}.pddl", DOMAIN)]

@behaviour("do-{id}", action="(do-{id} ?u - sensor ?h - host)")
async def do(ctx, u, h):
    {body}
'''

FAMILY_OF_HOGS = (
    "eat = 'b = []\\nwhile True: b.append(bytearray(1 << 20))'\n"
    "hogs = [subprocess.Popen([sys.executable, '-I', '-S', '-c', eat]) for _ in range(3)]\n"
    "while all(hog.poll() is None for hog in hogs):\n"
    "    await asyncio.sleep(0.05)\n"
    "await asyncio.sleep(60)"
)


def doer(id: str, body: str) -> Part:
    """Its goal is `(<id>-done self)`; `body` is of a coroutine with `ctx`, `u` and `h`."""
    source = SOURCE.replace("{body}", body.replace("\n", "\n    ")).replace("{id}", id)
    return Part(id, source)


def hogs(id: str = "hogs") -> Part:
    """Three processes that take memory for ever: each alone, and all together."""
    return doer(id, FAMILY_OF_HOGS)
