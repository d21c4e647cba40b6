"""The host speaks by components that speak, and takes goals from those that listen."""

from __future__ import annotations

from pathlib import Path

import pytest
from demo.robot import View
from tests.kit.beacon import BEACON
from tests.kit.golden import Golden
from tests.kit.payloads import Part
from tests.kit.running_host import running

from nondum.planning.words.asking import ASKED
from nondum.planning.words.stop_words import stop_patterns

ECHO = """
'''Hears what it has been told, and answers.'''
import asyncio
from nondum.sdk import hookimpl

spoken = asyncio.Queue()
answers = [("goal 1 holds", "mumble mumble"), ("mumble mumble", "greet people")]

@hookimpl
async def speak(ctx, text):
    spoken.put_nowait(text)

@hookimpl
async def listen(ctx):
    cue, words = answers.pop(0) if answers else ("never said", "")
    while cue not in await spoken.get():
        pass
    return {"words": words}
"""
PUPIL = """
'''Says each phrase once, as soon as it has learnt it.'''
import asyncio
from nondum.sdk import hookimpl

learnt = asyncio.Queue()

@hookimpl
async def learn_words(ctx, vocabulary):
    learnt.put_nowait(vocabulary)

@hookimpl
async def listen(ctx):
    while not (vocabulary := await learnt.get())["phrases"]:
        pass
    names = vocabulary["names"]
    said = [*sorted(vocabulary["phrases"]), *names.get("class", []), *names["addressee"]]
    return {"words": " ".join(["learnt", *said])}
"""
GUARD = """
'''Says one thing.'''
from nondum.sdk import hookimpl

said = ["SAID"]

@hookimpl
async def listen(ctx):
    return {"words": said.pop() if said else ""}
"""
MUTE = """
'''Neither speaks nor listens, for it hangs.'''
import time
from nondum.sdk import hookimpl

@hookimpl
def listen(ctx):
    time.sleep(3600)
"""


def test_robot_is_told_by_voice_and_answers(tmp_path: Path, golden: Golden) -> None:
    with running(tmp_path) as host:
        for id, source in (("beacon", BEACON), ("mute", MUTE), ("echo", ECHO)):
            host.plug(host.drive(id, Part(id, source)))
        host.until("all are ready", lambda view: are_ready(view, 3))
        host.run("goal", "shine", "--wait").ok()

        def greeted(view: View) -> View | None:
            goals = [(goal["text"], goal["holds"]) for goal in view["goals"]]
            return view if ("greet people", True) in goals else None

        view = host.until("the goal that was heard holds", greeted)
    told = [row["text"] for row in view["told"]]
    assert any(text.startswith("echo heard 'mumble mumble': PHRASE_UNKNOWN") for text in told)
    golden.check_line("a goal is heard", "\n".join(told))


def test_listener_learns_what_can_be_said_and_when_that_changes(tmp_path: Path) -> None:
    with running(tmp_path, name="panther") as host:
        host.plug(host.drive("pupil", Part("pupil", PUPIL)))
        host.until("the pupil is ready", lambda view: are_ready(view, 1))
        host.plug(host.drive("beacon", Part("beacon", BEACON)))
        said = (*ASKED, "greet {class}", "shine [for {text}]")
        asked = (f"[{{addressee}}] {pattern}" for pattern in said)
        learnt = sorted((*stop_patterns("{addressee}"), *asked))
        words = " ".join(["learnt", *learnt, "people", "person", "panther"])
        host.until_told(f"pupil heard {words!r}")
        lamp = BEACON.replace("shine [for {words:text}]", "light up")
        host.plug(host.drive("lamp", Part("lamp", lamp)))
        host.until_told("light up")


@pytest.mark.parametrize(
    "said", ["Stop!", "panther, stop", "Rover, stop!", "Stop, panther!", "Halt rover!"]
)
def test_robot_is_stopped_by_voice_whatever_name_it_is_called(tmp_path: Path, said: str) -> None:
    with running(tmp_path, name="panther") as host:
        host.plug(host.drive("beacon", Part("beacon", BEACON)))
        host.until("the beacon is ready", lambda view: are_ready(view, 1))
        id = host.run("goal", "shine", "--wait", "--json").ok().json["id"]
        host.plug(host.drive("guard", Part("guard", GUARD.replace("SAID", said))))
        host.until_told(f"guard heard {said!r}: stopped: 1 goal and 1 behaviour halted")
        host.until_goal(id, "halted")


CURIOUS = """
'''Asks until it hears the answer, and says that it has.'''
import asyncio
from nondum.sdk import hookimpl

spoken = asyncio.Queue()
asked = []

@hookimpl
async def speak(ctx, text):
    spoken.put_nowait(text)

@hookimpl
async def listen(ctx):
    if not asked:
        asked.append("Panther, what can you do?")
        return {"words": asked[0]}
    while not (await spoken.get()).startswith("I can "):
        pass
    return {"words": "learnt it"}
"""


def test_robot_that_is_asked_says_what_it_can_do(tmp_path: Path) -> None:
    with running(tmp_path, name="panther") as host:
        host.plug(host.drive("beacon", Part("beacon", BEACON)))
        host.until("the beacon is ready", lambda view: are_ready(view, 1))
        host.plug(host.drive("curious", Part("curious", CURIOUS)))
        host.until_told("I can greet people and shine.")
        host.until_told("curious heard 'learnt it': PHRASE_UNKNOWN")
        goals = host.view["goals"]
    assert not goals


def are_ready(view: View, count: int) -> bool:
    """Whether there are `count` components, all ready."""
    return [row["ready"] for row in view["components"]] == [True] * count
