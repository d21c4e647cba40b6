"""The host speaks by components that speak, and takes goals from those that listen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.host.cli.daemon import BEACON, running
from tests.kit.payloads import Part

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
    names = vocabulary["names"].get("class", [])
    return {"words": " ".join(["learnt", *sorted(vocabulary["phrases"]), *names])}
"""
MUTE = """
'''Neither speaks nor listens, for it hangs.'''
import time
from nondum.sdk import hookimpl

@hookimpl
def listen(ctx):
    time.sleep(3600)
"""


def test_robot_is_told_by_voice_and_answers(tmp_path: Path) -> None:
    with running(tmp_path) as daemon:
        for id, source in (("beacon", BEACON), ("mute", MUTE), ("echo", ECHO)):
            daemon.plug(f"org.example.{id}", Part(id, source))
        daemon.until(lambda view: [r["ready"] for r in view["components"]] == [True] * 3)
        daemon.run("goal", "shine", "--wait").ok()

        def greeted(view: dict[str, Any]) -> bool:
            return any((g["text"], g["holds"]) == ("greet people", True) for g in view["goals"])

        view = daemon.until(greeted)
    told = [row["text"] for row in view["told"]]
    assert any(text.startswith("echo heard 'mumble mumble': PHRASE_UNKNOWN") for text in told)
    assert "echo heard 'greet people': that is goal 2" in told


def test_listener_learns_what_can_be_said_and_when_that_changes(tmp_path: Path) -> None:
    with running(tmp_path) as daemon:
        daemon.plug("org.example.pupil", Part("pupil", PUPIL))
        daemon.until(lambda view: [r["ready"] for r in view["components"]] == [True])
        daemon.plug("org.example.beacon", Part("beacon", BEACON))
        beacon = "'learnt greet {class} shine [for {text}] people person'"
        daemon.until(lambda view: _was_told(view, f"pupil heard {beacon}"))
        lamp = BEACON.replace("shine [for {words:text}]", "light up")
        daemon.plug("org.example.lamp", Part("lamp", lamp))
        daemon.until(lambda view: _was_told(view, "light up"))


def _was_told(view: dict[str, Any], words: str) -> bool:
    return any(words in row["text"] for row in view["told"])
