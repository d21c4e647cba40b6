"""Two makers' payloads whose components, plugins and actions have one name are at work together."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import READY_S, RunningHost

pytestmark = pytest.mark.daemon

LAMP = '''"""A lamp that makes it WORD."""
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain lamp)
  (:predicates (WORD ?h - host))
  (:action shine :parameters (?u - light ?h - host)
    :precondition (and (ready ?u) (idle ?u)) :effect (and (not (idle ?u)) (WORD ?h))))
"""

@hookimpl
def units():
    return [Unit("led", "light")]

@hookimpl
def fragments():
    return [Fragment("lamp.pddl", DOMAIN)]

@hookimpl
def start(ctx):
    ctx.log.info("WORD")

@behaviour("shine", action="(shine ?u - light ?h - host)", lasting=True)
async def shine(ctx, u, h):
    await ctx.established()
    await ctx.sleep(3600)
'''
MAKERS = ("north", "south")


def lamp(maker: str, version: str = "1.0") -> Part:
    """The lamp of a maker, who calls it like the other one."""
    return Part("lamp", LAMP.replace("WORD", maker), version=version)


def beside(maker: str) -> str:
    """What its lamp is called on a host that had the other one's first."""
    return f"lamp--org-example-{maker}"


def names(host: RunningHost) -> dict[str, str]:
    """Payload → name of its component."""
    rows = host.ask("components")
    return {row["payload"].removeprefix("org.example."): row["component"] for row in rows}


def brought(host: RunningHost, *makers: str) -> tuple[list[Path], list[str]]:
    """Both lamps, one after the other, and a goal for each, which holds."""
    drives = [host.bring(maker, lamp(maker)) for maker in makers]
    goals = [host.want(f"({maker} spot)") for maker in makers]
    for goal in goals:
        host.until_goal(goal, "holds")
    return drives, goals


@pytest.mark.parametrize("first", MAKERS)
def test_goals_are_reached_by_both_whichever_comes_first(host: RunningHost, first: str) -> None:
    [second] = set(MAKERS) - {first}
    brought(host, first, second)
    assert names(host) == {first: "lamp", second: beside(second)}
    running = {row["component"] for row in host.ask("behaviours") if row["running"]}
    assert running == {"lamp", beside(second)}
    said = {row["component"]: row["message"] for row in host.ask("logs")}
    assert [said["lamp"], said[beside(second)]] == [first, second]


@pytest.mark.parametrize("pulled", MAKERS)
def test_the_other_one_goes_on_when_one_is_pulled(own_host: RunningHost, pulled: str) -> None:
    host = own_host
    drives, goals = brought(host, *MAKERS)
    at = MAKERS.index(pulled)
    before = host.component(names(host)[MAKERS[1 - at]])
    host.pull(pulled)
    host.until_goal(goals[at], "suspended")
    host.until_gone(pulled)
    assert before is not None
    after = host.component(before["component"])
    assert after is not None
    assert after["pid"] == before["pid"]
    host.until_goal(goals[1 - at], "holds")
    ended = {row["subject"] for row in host.journal() if row["event"] == "BehaviourEnded"}
    assert before["component"] not in ended
    host.plug(drives[at])
    host.until_goal(goals[at], "holds")
    assert names(host) == {"north": "lamp", "south": beside("south")}


def test_names_stay_when_the_daemon_starts_again_and_the_second_comes_first(
    own_host: RunningHost,
) -> None:
    host = own_host
    drives, goals = brought(host, *MAKERS)
    unit = f"spot__{beside('south')}__led"
    host.ask("mount", unit=unit, xyz=[0.1, 0.0, 0.2], rpy=[0.0, 0.0, 0.0])
    host.stop()
    for maker in MAKERS:
        host.pull(maker)
    host.start()
    for maker, drive in zip(reversed(MAKERS), reversed(drives), strict=True):
        host.plug(drive)
        host.until_step(maker, "active")
    assert names(host) == {"north": "lamp", "south": beside("south")}
    mounts = {row["unit"]: row["mount"] for row in host.ask("units")}
    assert mounts == {"spot__lamp__led": "unknown", unit: "person"}
    for goal in goals:
        host.until_goal(goal, "holds")


@pytest.mark.parametrize("upgraded", MAKERS)
def test_a_newer_release_has_the_name_of_the_one_before(
    own_host: RunningHost, upgraded: str
) -> None:
    host = own_host
    _, goals = brought(host, *MAKERS)
    called = names(host)
    drive, part, id = host.work / "newer", lamp(upgraded, "2.0"), f"org.example.{upgraded}"
    make_payload(drive, part, payload_id=id, version="2.0", release=2)
    host.plug(drive)
    name = called[upgraded]
    host.until(
        "the newer release is at work",
        lambda view: any(
            (row["component"], row["version"]) == (name, "2.0") for row in view["components"]
        ),
        timeout_s=READY_S,
    )
    assert names(host) == called
    for goal in goals:
        host.until_goal(goal, "holds")
