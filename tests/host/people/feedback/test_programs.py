"""Integrators' programs: told everything, and never waited for longer than they may take."""

from __future__ import annotations

import asyncio
import json
import os
import stat
from pathlib import Path

import pytest
from tests.kit.processes import until_gone

from nondum.host.core.feedback_state import NOTHING, State, StateReason
from nondum.host.people.feedback import program
from nondum.host.people.feedback.hook import Hook
from nondum.host.people.feedback.outputs import Outlet
from nondum.host.people.feedback.speaking import spoken
from nondum.sdk.errors import InstallFailed

pytestmark = pytest.mark.anyio

REFUSED = StateReason(
    State.REFUSED, "payload k", "it is not\nsigned; $(id)", "SIG_MISSING", "org.example.eye"
)
FOR_EVER_S = 600.0


def script(tmp_path: Path, text: str) -> str:
    path = tmp_path / "program"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


async def test_a_hook_is_told_everything_in_three_ways(tmp_path: Path) -> None:
    out = tmp_path / "out"
    hook = Hook(
        [script(tmp_path, f'printf "%s|" "$@" "$NONDUM_CODE" > {out}; cat >> {out}'), "first"], 60
    )
    await hook.show(REFUSED)
    arguments, _, told = out.read_text().rpartition("|")
    said = "it is not signed; $(id)"
    assert arguments.split("|") == [
        *("first", "refused", "SIG_MISSING", "org.example.eye", said, "SIG_MISSING")
    ]
    assert json.loads(told) == {**REFUSED.to_dict(), "sentence": said}


async def test_a_hook_that_does_not_end_is_killed_with_its_children(tmp_path: Path) -> None:
    pids = tmp_path / "pids"
    hook = Hook([script(tmp_path, f"sleep 999 & echo $! > {pids}; echo $$ >> {pids}; wait")], 1.0)
    with pytest.raises(InstallFailed) as overdue:
        await hook.show(REFUSED)
    assert overdue.value.code == "PROGRAM_OVERDUE"
    for pid in map(int, pids.read_text().split()):
        await until_gone(pid)


async def test_what_a_hook_leaves_behind_ends_with_it(tmp_path: Path) -> None:
    pids = tmp_path / "pids"
    hook = Hook([script(tmp_path, f"sleep 999 & echo $! > {pids}")], FOR_EVER_S)
    await hook.show(REFUSED)
    await until_gone(int(pids.read_text()))


async def test_a_hook_is_killed_with_the_daemon(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    hook = Hook([script(tmp_path, f"echo $$ > {fifo}; sleep 999")], FOR_EVER_S)
    showing = asyncio.create_task(hook.show(REFUSED))
    pid = int(await asyncio.to_thread(fifo.read_text))
    showing.cancel()
    await asyncio.gather(showing, return_exceptions=True)
    await until_gone(pid)


@pytest.mark.parametrize(
    ("text", "says"), [("exit 3", "status 3"), (None, "No such file or directory")]
)
async def test_a_hook_that_fails_is_told(tmp_path: Path, text: str | None, says: str) -> None:
    command = script(tmp_path, text) if text else str(tmp_path / "none")
    with pytest.raises(InstallFailed, match=says) as failed:
        await Hook([command], FOR_EVER_S).show(REFUSED)
    assert failed.value.code == "PROGRAM_FAILED"


async def test_of_endless_output_the_beginning_is_kept(tmp_path: Path) -> None:
    endless = script(tmp_path, "yes | head -c 1000000; echo end >&2")
    ended = await program.run([endless], {}, b"x" * 1_000_000, FOR_EVER_S)
    assert (ended.status, len(ended.output)) == (0, program.OUTPUT_BYTES - 1)


async def test_a_hook_runs_once_at_a_time_and_the_newest_state_wins(tmp_path: Path) -> None:
    begun, go, log = tmp_path / "begun", tmp_path / "go", tmp_path / "log"
    os.mkfifo(begun)
    os.mkfifo(go)
    one = f'echo "$1" >> {log}; echo . > {begun}; read _ < {go}; echo end >> {log}'
    outlet = Outlet(Hook([script(tmp_path, one)], FOR_EVER_S))
    running = asyncio.create_task(outlet.run())
    outlet.show(REFUSED)
    await asyncio.to_thread(begun.read_text)
    for state in (State.WORKING, State.SAFE, State.READY):
        outlet.show(StateReason(state, "drive a", "told"))
    await asyncio.to_thread(go.write_text, "on\n")
    await asyncio.to_thread(begun.read_text)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    assert log.read_text().split() == ["refused", "end", "ready"]


class Faulty:
    """An output that fails as long as it is told to."""

    def __init__(self) -> None:
        self.fails = True

    async def show(self, reason: StateReason) -> None:
        if self.fails:
            raise ZeroDivisionError

    async def end(self) -> None:
        raise ZeroDivisionError


async def test_an_output_that_fails_is_told_until_it_works(
    caplog: pytest.LogCaptureFixture,
) -> None:
    faulty = Faulty()
    outlet = Outlet(faulty)
    running = asyncio.create_task(outlet.run())
    for fails in (True, True, False):
        faulty.fails = fails
        outlet.show(REFUSED)
        await asyncio.sleep(0)  # the outlet's turn: nothing in it waits for anything else
        await asyncio.sleep(0)
        assert bool(outlet.problems) is fails
    running.cancel()
    [ended] = await asyncio.gather(running, return_exceptions=True)
    assert isinstance(ended, asyncio.CancelledError)
    assert sum("ZeroDivisionError()" in r.getMessage() for r in caplog.records) == 1


SAFE = StateReason(State.SAFE, "drive a", "drive a may be pulled", drive="a")


@pytest.mark.parametrize(
    ("reason", "aloud", "said"),
    [
        (SAFE, [], "drive a may be pulled"),
        (REFUSED, [], REFUSED.sentence),
        (REFUSED, ["org.example.eye is refused: SIG_MISSING it is not signed"], None),
        (REFUSED, ["org.example.arm is refused: SIG_MISSING it is not signed"], REFUSED.sentence),
        (NOTHING, [], None),
        (StateReason(State.WORKING, "drive a", "drive a is being read", drive="a"), [], None),
    ],
    ids=["safe", "refused", "told already", "told of another", "ready", "working"],
)
async def test_only_what_no_announcement_says_is_said(
    reason: StateReason, aloud: list[str], said: str | None
) -> None:
    assert spoken(reason, aloud, 160) == said
