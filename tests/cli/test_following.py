"""What is followed: what is there, and what comes, until who looks has enough."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import pytest
from tests.kit.beacon import BEACON_ID
from tests.kit.running_host import RunningHost
from tests.kit.screen import terminal
from tests.kit.until import until as until_seen

from nondum.host.control.client import ControlClient


def rows(process: subprocess.Popen[str]) -> Iterator[Any]:
    """What a command that follows prints with --json."""
    assert process.stdout is not None
    return map(json.loads, process.stdout)


def until(process: subprocess.Popen[str], is_it: Callable[[Any], bool]) -> Any:
    """The next that is so."""
    return next(row for row in rows(process) if is_it(row))


def test_the_journal_goes_on_with_what_happens(daemon: RunningHost) -> None:
    there = daemon.run("journal", "--json").ok().json
    with daemon.started("journal", "--follow", "--json") as process:
        assert [row["id"] for _, row in zip(there, rows(process), strict=False)] == [
            row["id"] for row in there
        ]
        id = daemon.run("goal", "shine", "--json").ok().json["id"]
        told = until(process, lambda row: row["subject"] == id)
        daemon.run("halt", "--now").ok()
        ended = until(process, lambda row: row["event"] == "GoalEnded")
    assert there[-1]["id"] < told["id"] < ended["id"]


def test_the_journal_of_one_subject_goes_on_with_that_alone(daemon: RunningHost) -> None:
    with daemon.started("journal", "--follow", "--limit", "1", "--subject", BEACON_ID) as process:
        assert process.stdout is not None
        assert BEACON_ID in process.stdout.readline()


def test_the_journal_since_a_while_is_no_longer_than_that(daemon: RunningHost) -> None:
    whole = daemon.run("journal", "--json", "--limit", "100000").ok().json
    assert daemon.run("journal", "--json", "--since", "1d").ok().json == whole
    last = daemon.run("journal", "--json", "--since", "1d", "--limit", "2").ok().json
    assert last == whole[-2:]


def test_logs_go_on_with_what_is_written(daemon: RunningHost) -> None:
    with daemon.started("logs", "beacon", "--since", "1h", "--follow", "--json") as process:
        assert until(process, lambda row: row["message"] == "polished")["component"] == "beacon"
    daemon.run("logs", "baecon", "--follow").refused(1, "COMPONENT_UNKNOWN")


def test_changed_goals_and_facts_are_shown_again(daemon: RunningHost) -> None:
    with (
        daemon.started("goals", "--follow", "--json") as goals,
        daemon.started("facts", "--follow", "--json") as facts,
    ):
        first, before = next(rows(goals)), next(rows(facts))
        assert {row["now"] for row in first["can"] if row["words"] == "shine"} == {"can"}
        daemon.run("goal", "shine").ok()
        until(goals, lambda view: any(row["now"] == "holds" for row in view["can"]))
        seen = [before]
        while not any(row["fact"] == "lit panther" for row in seen[-1]):
            seen.append(next(rows(facts)))
    ageless = [[(row["fact"], row["source"], row["value"]) for row in found] for found in seen]
    assert all(one != other for one, other in pairwise(ageless))
    daemon.run("halt", "--now").ok()


@pytest.mark.parametrize("verb", ["goals", "facts", "journal", "logs", "status", "tree"])
def test_following_begins_with_what_asking_prints(daemon: RunningHost, verb: str) -> None:
    lines = daemon.run(verb).ok().out.splitlines()
    first = lines[1] if verb == "journal" else lines[0]  # it is followed without names of columns
    with daemon.started(verb, "--follow") as process:
        assert process.stdout is not None
        assert process.stdout.readline().split()[:2] == first.split()[:2]


@pytest.mark.parametrize("colour", [{}, {"NO_COLOR": "1"}], ids=["colour", "no colour"])
@pytest.mark.parametrize("verb", ["goals", "facts", "status"])
def test_on_a_terminal_it_is_drawn_in_one_place(
    daemon: RunningHost, verb: str, colour: dict[str, str]
) -> None:
    told = {"goals": "WORDS", "facts": "FACT", "status": "host panther"}[verb]
    seen = {"goals": "active", "facts": "lit panther", "status": "active"}[verb]
    command = ("--control", daemon.control, verb, "--follow")
    with terminal(*command, columns=120, lines=100, **colour) as person:
        person.until(told)
        daemon.run("goal", "shine").ok()
        shown = person.until(seen)
        assert sum(line.startswith(told) for line in shown) == 1
        assert not (colour and person.screen.coloured)
    daemon.run("halt", "--now").ok()


def test_what_does_not_fit_a_terminal_is_counted(daemon: RunningHost) -> None:
    with terminal("--control", daemon.control, "facts", "-f", lines=6) as person:
        assert person.until("FACT", "more lines")[0].startswith("FACT")


@pytest.mark.parametrize("ago", ["soon", "-3min", "0s", "10 fortnights"])
def test_a_time_that_is_none_is_refused_with_examples(daemon: RunningHost, ago: str) -> None:
    for verb in ("journal", "logs"):
        daemon.run(verb, f"--since={ago}").refused(2, "10min")


def test_a_stream_that_flows_has_a_rate(daemon: RunningHost) -> None:
    daemon.run("goal", "shine", "--wait").ok()

    def rate_hz() -> float:
        (row,) = daemon.ask("streams")
        return float(row["rate_hz"] or 0)

    assert 0 < until_seen("there is a rate", rate_hz) < 200
    assert "/s" in daemon.run("streams").ok().out
    daemon.run("halt", "--now").ok()
    until_seen("there is none", lambda: not rate_hz())


def test_who_asks_for_it_is_told_again_although_nothing_has_changed(daemon: RunningHost) -> None:
    with ControlClient(daemon.control) as client:
        views = client.follow("watch", every_s=1)
        told = [next(views)["machine"]["load"] for _ in range(4)]
    assert all(told)
