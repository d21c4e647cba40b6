"""Words that a person says too early: kept while payloads come in, given once they can be."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.daemon.neighbours import BEACON, UNCONFINED, listener, say
from tests.kit.golden import Golden
from tests.kit.payloads import Part
from tests.kit.running_host import READY_S, RunningHost, running

pytestmark = pytest.mark.daemon

SLOW = (
    BEACON.replace("LAMP", "light").replace("LOST", "stop")
    + """
import asyncio, os

@hookimpl
async def start(ctx):
    while not os.path.exists("LET"):
        await asyncio.sleep(0.05)
    assert "well" in open("LET").read()
"""
)
"""Starts once it is let, and fails unless it is let well."""


class Slow:
    """A payload that is being installed until it is let."""

    def __init__(self, host: RunningHost) -> None:
        """The host has a listener, too: see `says`."""
        self._said = host.work / "said"
        host.bring("microphone", listener(self._said))
        self.host, self._let = host, host.work / "let"
        source = SLOW.replace("LOG", str(host.work / "log")).replace("LET", str(self._let))
        host.plug(host.drive("slow", Part("beacon", source)))
        host.until_step("slow", "stored", "probed")

    def let(self, how: str = "well") -> None:
        written = self._let.with_suffix(".part")
        written.write_text(how)
        written.rename(self._let)

    def says(self, words: str) -> None:
        say(self._said, words)


@pytest.fixture
def slow(tmp_path: Path) -> Iterator[Slow]:
    with running(tmp_path, more=UNCONFINED) as host:
        yield Slow(host)


def state(host: RunningHost, id: str) -> str:
    (row,) = (row for row in host.ask("goals")["given"] if row["id"] == id)
    return str(row["state"])


def test_words_said_too_early_are_refused_with_the_reason_and_the_way(
    slow: Slow, golden: Golden
) -> None:
    refused = slow.host.run("goal", "blink")
    refused.refused(1, "PHRASE_EARLY")
    golden.check_line("words are typed too early", refused.err)
    assert not slow.host.ask("goals")["given"]


def test_words_that_are_kept_are_given_once_they_mean_something(slow: Slow, golden: Golden) -> None:
    kept = slow.host.run("goal", "blink", "--keep", "--priority", "3", "--json").ok().json
    assert (kept["state"], kept["text"], kept["goal"]) == ("kept", "blink", "")
    golden.check("words are kept", kept["reason"])
    slow.let()
    reached = slow.host.until_goal(kept["id"], "reached")
    assert (reached["goal"], reached["priority"]) == ("(seen spot)", 3)


def test_goal_command_that_waits_tells_how_the_goal_ends(slow: Slow) -> None:
    with slow.host.started("goal", "blink", "--wait", "--json") as waiting:
        slow.host.until("the words are kept", lambda view: any(view["goals"]), timeout_s=READY_S)
        slow.let()
        row = json.loads(waiting.communicate()[0])
    assert (waiting.returncode, row["state"], row["holds"]) == (0, "reached", True)


def test_words_that_nothing_understands_are_given_up_when_all_has_come(slow: Slow) -> None:
    kept = slow.host.ask("goal", words="dance", keep=True)["id"]
    with slow.host.started("goal", "dance", "--wait", "--json") as waiting:
        slow.host.until("both are kept", lambda view: len(view["goals"]) == 2, timeout_s=READY_S)
        slow.let()
        row = json.loads(waiting.communicate()[0])
    assert (waiting.returncode, row["state"]) == (1, "halted")
    assert row["reason"].startswith("PHRASE_UNKNOWN")
    assert state(slow.host, kept) == "kept"


def test_words_are_given_up_when_what_they_wait_for_does_not_come(slow: Slow) -> None:
    with slow.host.started("goal", "blink", "--wait", "--json") as waiting:
        slow.host.until("the words are kept", lambda view: any(view["goals"]), timeout_s=READY_S)
        slow.let("badly")
        row = json.loads(waiting.communicate()[0])
    assert (waiting.returncode, row["state"]) == (1, "halted")


def test_words_spoken_too_early_are_kept_while_payloads_come_in(slow: Slow, golden: Golden) -> None:
    slow.says("blink")
    told = slow.host.until_told("'blink': that is kept as goal ")
    golden.check("words are spoken too early", told)
    slow.let()
    slow.host.until_goal("1", "reached")
    slow.says("dance")
    slow.host.until_told("'dance': PHRASE_UNKNOWN")


def test_stop_ends_kept_goals(slow: Slow) -> None:
    kept = slow.host.ask("goal", words="blink", keep=True)["id"]
    assert kept in slow.host.ask("goal", words="stop")["stopped"]["goals"]
    slow.let()
    slow.host.until_step("slow", "active")
    assert state(slow.host, kept) == "halted"
    slow.host.until_goal(slow.host.ask("resume", id=kept)["id"], "reached")
