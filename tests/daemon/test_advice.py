"""A host that cannot do what it is asked for says what is missing, and what would bring it."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from demo.robot import NONDUM
from tests.daemon.plugins import scribe, talker
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import RunningHost

pytestmark = pytest.mark.daemon

KNOBS = " ".join(f"k{number}" for number in range(60))
WIDE = f'''"""Says that sixty knobs, three at a time, make anything be written."""
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain wide)
  (:types knob - object)
  (:constants {KNOBS} - knob)
  (:predicates (written ?h - host))
  (:action turn
    :parameters (?u - sensor ?a ?b ?c - knob ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (written ?h)))
"""

@hookimpl
def units():
    return [Unit("panel", "sensor")]

@hookimpl
def fragments():
    return [Fragment("wide.pddl", DOMAIN)]

@behaviour("turn", action="(turn ?u - sensor ?a ?b ?c - knob ?h - host)")
async def turn(ctx, u, a, b, c, h):
    ctx.know("written", h)
'''


def nondum(host: RunningHost, *arguments: str | Path) -> Any:
    """What a person's command answers in JSON."""
    command = [*NONDUM, "--control", str(host.control), *map(str, arguments), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_pulled_payload_is_named_as_what_brings_the_goal_back(host: RunningHost) -> None:
    host.bring("write", scribe())
    host.bring("talk", talker())
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    host.pull("talk")
    host.until_gone("talk")
    host.until_goal(goal, "suspended")
    assert host.until_told("→ plug in org.example.talk 1.0")
    found = nondum(host, "why", goal)
    assert [problem["code"] for problem in found["causes"]] == ["WHY_NO_OBJECT", "WHY_SUPPLIER"]
    [way] = found["ways"]
    [payload] = way["payloads"]
    assert payload["payload"] == "org.example.talk"
    assert payload["where"].startswith("here until ")
    assert [step.split(" ")[0] for step in way["plan"]] == ["test-talker.talk", "test-scribe.write"]


def test_wheelhouse_offers_what_the_host_has_never_seen(host: RunningHost, tmp_path: Path) -> None:
    shelf = tmp_path / "shelf"
    make_payload(shelf, talker("left"), payload_id="org.example.left")
    make_payload(shelf, talker("right"), payload_id="org.example.right")
    host.bring("write", scribe())
    found = nondum(host, "advise", "(written self)", "--wheelhouse", shelf)
    offered = [[row["payload"] for row in way["payloads"]] for way in found["ways"]]
    assert offered == [["org.example.left"], ["org.example.right"]]
    host.plug(shelf)
    host.until_step("left", "active")
    plan = nondum(host, "advise", "(written self)")["now"]["plan"]
    assert plan == found["ways"][0]["plan"] or plan == found["ways"][1]["plan"]


def test_payload_with_too_many_ways_to_act_stops_nothing_else(host: RunningHost) -> None:
    host.bring("wide", Part("wide", WIDE))
    host.bring("write", scribe())
    host.bring("talk", talker())
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    told = host.until_told("wide is kept out of planning: PDDL_TOO_MANY")
    assert told in host.ask("status")["warnings"]
    assert any("PDDL_TOO_MANY" in problem for problem in host.ask("why")["problems"])
    host.pull("wide")
    host.until_gone("wide")
    host.until_told("wide is gone")
    assert told not in host.ask("status")["warnings"]
