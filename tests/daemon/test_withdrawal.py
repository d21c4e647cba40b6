"""A drive is pulled at every phase that a person can see: all of it is undone, and told."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest
from tests.daemon.plugins import scribe, talker, watcher
from tests.kit.golden import Golden
from tests.kit.payloads import Part, make_wheel
from tests.kit.running_host import Row, RunningHost, happened, payload, steps
from tests.kit.traces import former_payloads

pytestmark = pytest.mark.daemon

BALLAST_MB = 48
SLOW_START = """
@hookimpl
async def start(ctx):
    await ctx.sleep(20)
"""
PHASES = {"copy": "received", "verify": "copied", "store": "staged", "probe": "stored"}


@pytest.fixture(scope="module")
def heavy(tmp_path_factory: pytest.TempPathFactory) -> Part:
    """A talker that takes its time, in each phase, to become active."""
    data = {"ballast.bin": os.urandom(BALLAST_MB * 1024**2)}
    ballast = make_wheel(tmp_path_factory.mktemp("wheels"), "ballast", "1.0", data)
    part = talker("heavy", wheels=[ballast])
    return replace(part, source=part.source + SLOW_START)


@pytest.mark.parametrize("phase", PHASES)
def test_drive_pulled_while_it_is_installed(
    host: RunningHost, heavy: Part, phase: str, golden: Golden
) -> None:
    host.bring("keeper", scribe("keeper"))
    keeper, before = host.component("keeper"), host.traces()
    host.plug(host.drive("heavy", heavy))
    host.until_step("heavy", PHASES[phase])
    host.pull("heavy")
    host.until_gone("heavy")
    assert host.traces() == before
    assert former_payloads(host.state) == {}
    assert host.component("keeper") == keeper
    assert host.until_told("org.example.heavy is withdrawn: its drive was pulled")
    (withdrawn,) = (e for e in host.journal("org.example.heavy") if e["step"] == "removing")
    golden.check("a drive is pulled", withdrawn["detail"]["reason"])
    assert not any(c["component"] == "heavy" for view in host.views for c in view["components"])


def test_drive_pulled_while_nothing_is_asked_for(host: RunningHost) -> None:
    before = host.traces()
    host.bring("talk", talker())
    stored = len(host.ask("store"))
    host.pull("talk")
    host.until_gone("talk")
    host.until_told("talker is gone: it could talk")
    assert host.traces() == before
    assert len(host.ask("store")) == stored > 0
    assert former_payloads(host.state) == {"org.example.talk": {"talker"}}
    host.ask("forget", payload="org.example.talk")
    assert former_payloads(host.state) == {}


def test_drive_pulled_in_the_middle_of_a_behaviour(host: RunningHost, golden: Golden) -> None:
    host.bring("write", scribe())
    goal = host.want("(written spot)")
    host.until_goal(goal, "suspended")
    before = host.traces()
    host.bring("talk", talker())
    host.until_goal(goal, "holds")
    seen, last_told = len(host.views), host.view["told"][-1]["number"]
    host.pull("talk")
    host.until_gone("talk")
    reason = host.until_goal(goal, "suspended")["reason"]
    assert host.traces() == before
    withdrawn = [view for view in host.views[seen:] if is_withdrawn(view, "talk")]
    for view in withdrawn:  # the first included
        assert "talker" not in {row["component"] for row in view["components"]}
        assert not view["streams"]
        assert not [action for action in steps(view) if "talker" in action]
    golden.check("a goal lacks what was pulled", reason)
    told = host.until_told("cannot '(written spot)' now", since=last_told)
    assert "talker" in told, "it is said which component used to supply what is missing"
    assert happened(
        host.journal(),
        ("PayloadWithdrawn", "org.example.talk"),
        ("Recomposed", ""),
        ("BehaviourEnded", "talker"),
        ("PayloadCleared", "org.example.talk"),
    )


def test_what_looked_from_a_place_that_is_gone_is_halted_and_does_not_fail(
    host: RunningHost,
) -> None:
    host.bring("watch", watcher())
    mouth = '[[component.unit]]\nname = "mouth"\nxyz = [0, 0, 1]\nrpy = [0, 0, 0]\n'
    drive = host.drive("talk", talker(manifest=mouth))
    goal = host.want("(watched spot)")
    for _ in range(3):
        before = endings(host, "watcher")
        host.plug(drive)
        host.until_goal(goal, "holds")
        host.pull("talk")
        host.until_gone("talk")
        assert until_one_more(host, "watcher", before) == "HALTED"


def until_one_more(host: RunningHost, component: str, before: list[str]) -> str:
    """Wait until another behaviour of a component has ended; how it did."""
    (outcome,) = host.until("it has ended", lambda _: endings(host, component)[len(before) :])
    return str(outcome)


def endings(host: RunningHost, component: str) -> list[str]:
    """How the behaviours of a component ended, oldest first."""
    ends = (row for row in host.journal(component) if row["event"] == "BehaviourEnded")
    return [row["detail"]["outcome"] for row in ends]


def test_same_drive_plugged_again_is_at_work_again(own_host: RunningHost) -> None:
    host = own_host  # whose store is empty
    host.bring("write", scribe())
    drive = host.bring("talk", talker())
    goal = host.want("(written spot)")
    host.until_goal(goal, "holds")
    first = host.component("talker")
    host.pull("talk")
    host.until_gone("talk")
    host.until_goal(goal, "suspended")
    host.plug(drive)
    host.until_goal(goal, "holds")
    again = host.component("talker")
    assert first is not None
    assert again is not None
    assert {**again, "pid": 0} == {**first, "pid": 0}
    assert again["pid"] != first["pid"]
    copied = [
        e["detail"] for e in host.journal("org.example.talk") if e["event"] == "PayloadCopied"
    ]
    assert [detail["bytes_known"] > 0 for detail in copied] == [True, True]
    assert [detail["bytes_copied"] == 0 for detail in copied] == [False, True]
    fresh = [e["detail"]["fresh"] for e in host.journal() if e["event"] == "WheelsStored"]
    assert fresh[-1] == 0


def is_withdrawn(view: Row, name: str) -> bool:
    """Whether a view was taken after a payload's withdrawal."""
    row = payload(view, name)
    return row is None or row["state"] == "removing"
