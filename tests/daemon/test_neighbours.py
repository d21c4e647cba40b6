"""What one host can do, another one plans with and uses, until either is gone."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.daemon.neighbours import beacon, listener, neighbours, routed, say, until_shared, written
from tests.daemon.plugins import scribe, talker
from tests.kit.golden import Golden
from tests.kit.payloads import Part
from tests.kit.running_host import READY_S, RunningHost
from tests.kit.shared import Shared
from tests.kit.until import until

pytestmark = pytest.mark.daemon

Hosts = list[RunningHost]
INTERPRETER = """
'''Translates each sentence to `shine`, where a host has that phrase.'''
from nondum.sdk import hookimpl

@hookimpl
async def translate_goal(ctx, words, vocabulary):
    return {"words": "shine"} if "shine" in vocabulary["sentences"] else None
"""


@pytest.fixture(scope="module")
def one_pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared[Hosts]]:
    with Shared(lambda: neighbours(tmp_path_factory.mktemp("two"), "rover", "mule")) as shared:
        yield shared


@pytest.fixture
def pair(one_pair: Shared[Hosts]) -> Iterator[Hosts]:
    """Rover and mule, with nothing plugged in."""
    with one_pair.lent() as hosts:
        yield hosts


@pytest.fixture(scope="module")
def one_trio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared[Hosts]]:
    names = ("rover", "scout", "mule")
    with Shared(lambda: neighbours(tmp_path_factory.mktemp("three"), *names)) as shared:
        yield shared


@pytest.fixture
def trio(one_trio: Shared[Hosts]) -> Iterator[Hosts]:
    """Rover, scout and mule, with nothing plugged in."""
    with one_trio.lent() as hosts:
        yield hosts


def until_written(log: Path, *words: str) -> None:
    """Wait for a beacon to have written exactly that."""
    until(
        f"a beacon has written {words}",
        lambda: written(log) == list(words),
        evidence=lambda: written(log),
    )


def shining(log: Path) -> Part:
    """A lamp of its host alone, which can be asked to shine."""
    part = beacon(log, type="pointer")
    source = part.source.replace("lasting=True,", 'lasting=True, phrase="shine",')
    return replace(part, source=source)


def until_elsewhere(host: RunningHost, goal: str, state: str) -> None:
    """Wait until a host knows the state of a goal that it gave to a peer."""

    def known() -> dict[str, str]:
        return {row["id"]: row["state"] for row in host.ask("goals")["elsewhere"]}

    until(f"goal {goal} of a peer is {state}", lambda: known().get(goal) == state, evidence=known)


def until_lost(host: RunningHost, component: str) -> None:
    """Wait until a component is not known any more."""
    host.until(
        f"{component} is gone",
        lambda view: all(row["component"] != component for row in view["components"]),
        timeout_s=READY_S,
    )


def test_what_is_plugged_into_one_host_is_used_by_the_other(pair: Hosts, tmp_path: Path) -> None:
    log = tmp_path / "log"
    rover, mule = pair
    mule.bring("light", beacon(log))
    until_shared(rover, "beacon@mule")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    assert written(log) == ["on"]
    rover.ask("halt", id=goal)
    until_written(log, "on", "off")


def test_phrase_of_a_peers_component_is_understood(pair: Hosts, tmp_path: Path) -> None:
    log = tmp_path / "log"
    rover, mule = pair
    mule.bring("light", beacon(log))
    until_shared(rover, "beacon@mule")
    given = rover.ask("goal", words="blink")
    rover.until_goal(given["id"], "reached")
    assert written(log) == ["blink"]


def test_pulled_drive_is_withdrawn_everywhere(pair: Hosts, tmp_path: Path) -> None:
    log = tmp_path / "log"
    rover, mule = pair
    mule.bring("light", beacon(log))
    until_shared(rover, "beacon@mule")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    mule.pull("light")
    until_lost(rover, "beacon@mule")
    rover.until_goal(goal, "suspended")
    assert "bring the host mule back" in str(rover.ask("why")["problems"])


@pytest.mark.parametrize("end", ["kill", "stop", "SIGSTOP"])
def test_host_that_is_lost_is_pruned_and_its_goal_waits_for_it(end: str, tmp_path: Path) -> None:
    log = tmp_path / "log"
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", beacon(log))
        until_shared(rover, "beacon@mule")
        goal = rover.want("(lit rover)")
        rover.until_goal(goal, "holds")
        stopped = mule.pid
        ends: dict[str, Callable[[], object]] = {"kill": mule.kill, "stop": mule.stop}
        ends.get(end, lambda: os.kill(stopped, signal.SIGSTOP))()
        try:
            rover.until_told("the host mule is gone")
            until_lost(rover, "beacon@mule")
            rover.until_goal(goal, "suspended")
            assert "bring the host mule back" in str(rover.ask("why")["problems"])
        finally:
            if end == "SIGSTOP":
                os.kill(stopped, signal.SIGCONT)
        if end != "SIGSTOP":
            mule.start()
        rover.until_goal(goal, "holds")


@pytest.mark.parametrize(
    ("when_lost", "after"), [("stop", ["on", "off"]), ("hold", ["on"]), ("finish", ["on"])]
)
def test_behaviour_ends_with_its_caller_as_its_author_declared(
    when_lost: str, after: list[str], tmp_path: Path
) -> None:
    log = tmp_path / "log"
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", beacon(log, when_lost=when_lost))
        until_shared(rover, "beacon@mule")
        rover.until_goal(rover.want("(lit rover)"), "holds")
        rover.kill()
        mule.until_told("the host rover is gone")
        until_written(log, *after)
        if when_lost != "stop":
            mule.ask("halt", now=True)
            until_written(log, "on", "off")


def test_unit_in_use_by_one_host_is_planned_with_by_no_other(trio: Hosts, tmp_path: Path) -> None:
    log = tmp_path / "log"
    rover, scout, mule = trio
    mule.bring("light", beacon(log))
    for host in (rover, scout):
        until_shared(host, "beacon@mule")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    for host in (scout, mule):
        waiting = host.want(f"(lit {host.name})")
        host.until_goal(waiting, "suspended")
        assert "idle mule__beacon__lamp" not in host.facts()
        host.ask("halt", id=waiting)
    waiting = scout.want("(lit scout)")
    rover.ask("halt", id=goal)
    scout.until_goal(waiting, "holds")
    assert written(log) == ["on", "off", "on"]


def test_actuators_are_not_offered_unless_the_integrator_says_so(
    tmp_path: Path, golden: Golden
) -> None:
    log = tmp_path / "log"
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        mule.bring("light", beacon(log, type="pointer"))
        until_shared(rover, "beacon@mule")
        (row,) = [r for r in rover.ask("components") if r["component"] == "beacon@mule"]
        assert (row["units"], row["behaviours"]) == ([], [])
        golden.check("an actuator is not offered", row["problem"])
        told = rover.until_told("beacon@mule is here")
        golden.check("a component comes without its actuator", told)
    more = 'offer_actuators = ["beacon"]\n'
    with neighbours(tmp_path / "again", "rover", "mule", more=more) as (rover, mule):
        mule.bring("light", beacon(log, type="pointer"))
        until_shared(rover, "beacon@mule")
        rover.until_goal(rover.want("(lit rover)"), "holds")


def test_stream_of_one_host_is_read_on_the_other(pair: Hosts) -> None:
    rover, mule = pair
    rover.bring("talk", talker("talker"))
    mule.bring("write", scribe())
    until_shared(rover, "scribe@mule")
    goal = rover.want("(written rover)")
    rover.until_goal(goal, "holds")
    (row,) = mule.ask("streams")
    assert (row["component"], row["consumers"]) == ("talker@rover", ["scribe"])
    rover.ask("halt", id=goal)
    mule.until("it is read no more", lambda view: not view["streams"], timeout_s=READY_S)


def test_hosts_by_way_of_a_router_use_each_other_all_the_same(tmp_path: Path) -> None:
    with routed(tmp_path, "rover", "mule") as (rover, mule):
        assert {row["by"] for row in rover.ask("peers")} == {"development"}
        rover.bring("talk", talker("talker"))
        mule.bring("write", scribe())
        until_shared(rover, "scribe@mule")
        goal = rover.want("(written rover)")
        rover.until_goal(goal, "holds")
        mule.kill()
        until_lost(rover, "scribe@mule")
        rover.until_goal(goal, "suspended")


def test_camera_of_another_body_is_not_planned_with(trio: Hosts) -> None:
    rover, scout, mule = trio
    rover.bring("talk", talker("talker"))
    mule.bring("write", scribe())
    for component in ("talker@rover", "scribe@mule"):
        until_shared(scout, component)
    scout.until_goal(scout.want("(written scout)"), "suspended")
    rover.until_goal(rover.want("(written rover)"), "holds")


def test_spoken_stop_stops_every_host(pair: Hosts, tmp_path: Path) -> None:
    said = tmp_path / "said"
    rover, mule = pair
    mule.bring("microphone", listener(said))
    rover.bring("talk", talker("talker"))
    rover.bring("write", scribe())
    until_shared(mule, "scribe@rover")
    goal = rover.want("(written rover)")
    rover.until_goal(goal, "holds")
    say(said, "stop, please")
    mule.until_told("stopped, with rover")
    rover.until_goal(goal, "halted")
    rover.until("nothing runs", lambda view: not view["plan"]["steps"])
    other = rover.want("(written rover)")
    rover.until_goal(other, "holds")
    say(said, "rover, halt")
    mule.until_told("'rover, halt': rover has stopped")
    rover.until_goal(other, "halted")
    third = rover.want("(written rover)")
    rover.until_goal(third, "holds")
    say(said, "river, halt")
    mule.until_told("'river, halt': stopped, with rover")
    rover.until_goal(third, "halted")


def test_spoken_goal_goes_to_the_peer_that_can_have_it(
    pair: Hosts, tmp_path: Path, golden: Golden
) -> None:
    said, log = tmp_path / "said", tmp_path / "log"
    rover, mule = pair
    mule.bring("microphone", listener(said))
    rover.bring("light", beacon(log, type="pointer"))
    until_shared(mule, "beacon@rover")
    say(said, "rover, blink")
    told = mule.until_told("'rover, blink': that is goal ")
    (number,) = re.findall(r"that is goal (\d+) of rover", told)
    rover.until_goal(number, "reached")
    mule.until_told("rover: 'blink' is reached")
    say(said, "blink")
    mule.until_told(f"'blink': that is goal {int(number) + 1} of rover")
    typed = mule.run("say", "rover, blink").ok().out
    golden.check("a peer takes a goal", typed, id=int(number) + 2)
    assert mule.run("say", "mule, what are you doing").ok().out.startswith("I do nothing")


def test_typed_goal_goes_where_a_spoken_one_would(pair: Hosts, tmp_path: Path) -> None:
    rover, mule = pair
    rover.bring("light", beacon(tmp_path / "log", type="pointer"))
    until_shared(mule, "beacon@rover")
    for words in ("rover, blink", "blink"):
        given = mule.run("goal", words, "--wait", "--json").ok().json
        assert (given["host"], given["is_elsewhere"], given["text"]) == ("rover", True, "blink")
        assert (given["goal"], given["state"], given["holds"]) == ("(seen rover)", "reached", True)
        rover.until_goal(given["id"], "reached")
    assert [row["state"] for row in mule.ask("goals")["elsewhere"]][-2:] == ["reached"] * 2
    assert not [row for row in mule.ask("goals")["given"] if row["text"].endswith("blink")]
    assert rover.ask("goal", words="rover, blink")["host"] == "rover"


def test_question_that_names_a_host_is_answered_by_it(pair: Hosts, tmp_path: Path) -> None:
    rover, mule = pair
    rover.bring("light", beacon(tmp_path / "log", type="pointer"))
    until_shared(mule, "beacon@rover")
    asked = mule.ask("say", words="rover, what can you do?")["answer"]
    assert asked.startswith("rover: I can blink")
    assert mule.ask("goal", words="rover, what can you do")["answer"] == asked
    assert not mule.ask("say", words="what can you do")["answer"].startswith("rover")
    rover.until_goal(rover.want("(lit rover)"), "holds")
    assert "(lit rover)" in mule.ask("say", words="rover, what are you doing")["answer"]


def test_words_are_translated_by_a_component_of_a_peer(pair: Hosts, tmp_path: Path) -> None:
    rover, mule = pair
    mule.bring("interpreter", Part("interpreter", INTERPRETER))
    rover.bring("light", shining(tmp_path / "log"))
    given = rover.ask("goal", words="I cannot see a thing", yes=True)
    assert given["understood"]["by"] == ["interpreter@mule"]
    rover.until_goal(given["id"], "holds")


def test_spoken_question_is_answered_by_the_host_that_it_names(pair: Hosts, tmp_path: Path) -> None:
    said = tmp_path / "said"
    rover, mule = pair
    mule.bring("microphone", listener(said))
    rover.bring("light", beacon(tmp_path / "log", type="pointer"))
    until_shared(mule, "beacon@rover")
    say(said, "rover, what can you do?")
    mule.until_told("rover: I can blink")


def test_word_that_stops_may_be_typed_for_one_host(pair: Hosts, tmp_path: Path) -> None:
    rover, mule = pair
    rover.bring("light", beacon(tmp_path / "log", type="pointer"))
    until_shared(mule, "beacon@rover")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    assert mule.ask("goal", words="rover, stop")["stopped"]["peers"] == ["rover"]
    rover.until_goal(goal, "halted")
    assert mule.ask("goal", words="mule, halt")["stopped"]["peers"] == []
    assert mule.ask("goal", words="river, halt")["stopped"]["peers"] == ["rover"]


def test_name_of_the_host_that_stops_may_come_last(
    pair: Hosts, tmp_path: Path, golden: Golden
) -> None:
    rover, mule = pair
    rover.bring("light", beacon(tmp_path / "log", type="pointer"))
    until_shared(mule, "beacon@rover")
    goal = rover.want("(lit rover)")
    rover.until_goal(goal, "holds")
    assert mule.ask("goal", words="halt mule")["stopped"]["peers"] == []
    golden.check("a peer stops", mule.ask("say", words="please stop rover now")["answer"])
    rover.until_goal(goal, "halted")
    assert mule.ask("goal", words="stop, rover")["stopped"]["peers"] == ["rover"]
    assert mule.ask("goal", words="stop, river")["stopped"]["peers"] == ["rover"]


def test_goal_of_a_host_that_is_gone_is_not_known_any_more(tmp_path: Path) -> None:
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        rover.bring("light", shining(tmp_path / "log"))
        until_shared(mule, "beacon@rover")
        given = mule.run("goal", "rover,", "shine", "--wait", "--json").ok().json
        assert (given["state"], given["holds"]) == ("active", True)
        [why] = mule.ask("why")["sentences"]
        assert why.startswith(f"goal {given['id']} of rover, 'shine', is active")
        rover.kill()
        mule.until_told("the host rover is gone")
        (row,) = mule.ask("goals")["elsewhere"]
        assert (row["id"], row["state"], row["holds"]) == (given["id"], "unknown", False)


@pytest.mark.parametrize("end", ["kill", "SIGSTOP"])
def test_goal_of_a_host_that_is_back_is_told_of_again(end: str, tmp_path: Path) -> None:
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        rover.bring("light", shining(tmp_path / "log"))
        until_shared(mule, "beacon@rover")
        given = mule.run("goal", "rover,", "shine", "--wait", "--json").ok().json
        stopped = rover.pid
        rover.kill() if end == "kill" else os.kill(stopped, signal.SIGSTOP)
        mule.until_told("the host rover is gone")
        until_elsewhere(mule, given["id"], "unknown")
        rover.start() if end == "kill" else os.kill(stopped, signal.SIGCONT)
        until_elsewhere(mule, given["id"], "active")
        rover.ask("halt", id=given["id"])
        until_elsewhere(mule, given["id"], "halted")


def test_words_that_are_kept_go_to_the_host_that_comes_back(tmp_path: Path) -> None:
    with neighbours(tmp_path, "rover", "mule") as (rover, mule):
        rover.bring("light", beacon(tmp_path / "log", type="pointer"))
        until_shared(mule, "beacon@rover")
        rover.kill()
        mule.until_told("the host rover is gone")
        mule.run("goal", "rover, blink").refused(1, "PHRASE_")
        kept = [
            mule.run("goal", "--keep", words, "--json").ok().json["id"]
            for words in ("rover, blink", "blink")
        ]
        rover.start()
        for id in kept:
            mule.until_goal(id, "halted")
        given = mule.ask("goals")["elsewhere"]
        assert [(row["host"], row["text"]) for row in given] == [("rover", "blink")] * 2
        for row in given:
            until_elsewhere(mule, row["id"], "reached")
