"""Runs one campaign: its folder, its command, and what that came to.

build/campaigns/NAME/state.json   what the present round belongs to, and what it took so far
build/campaigns/NAME/round/       what was done of it
build/campaigns/NAME/keep/        what is of use beyond one round
build/campaigns/NAME/log          what the command said last time
build/campaigns/NAME/failed-…/    a former round in which something failed
"""

from __future__ import annotations

import fcntl
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from tests.campaign import checkout, page
from tests.campaign.age import ages
from tests.campaign.page import Last
from tests.campaign.progress import Progress
from tests.campaign.registry import Campaign

FOLDER = Path("build/campaigns")
ENDS_WITHIN_S = 180.0
"""A command that was told to end, and ends its pieces, is killed after that."""


class AlreadyRunning(Exception):
    """Another process runs the campaign in this checkout."""


@dataclass(frozen=True, slots=True)
class State:
    """What a round belongs to: it is over once the paths that it covers change."""

    contents: str
    """A hash of these paths."""
    seed: int
    minutes: float = 0.0
    """That it took so far."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run of a campaign came to."""

    campaign: str
    result: str
    """`passed`, `failed`, or `N of M` pieces."""
    minutes: float
    """Of this run."""
    commit: str
    seed: int
    evidence: str
    """The folder of the round."""
    failed: tuple[str, ...] = ()
    """Pieces."""
    was_interrupted: bool = False


def run(
    root: Path,
    campaign: Campaign,
    minutes: float | None,
    seed: int,
    *,
    again: bool = False,
    is_seed_asked: bool = False,
    say: Callable[[str], None],
) -> Outcome:
    """Go on with a campaign for `minutes`, and write the result into the page.

    With None for the minutes it goes on until it is done. A round goes on with the seed that it
    began with, unless a seed is asked for. Raises `AlreadyRunning`.
    """
    home = root / FOLDER / campaign.name
    home.mkdir(parents=True, exist_ok=True)
    with (home / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise AlreadyRunning(campaign.name) from error
        state = State(checkout.contents(root, campaign.covers), seed)
        old = None if again else _goes_on(root, campaign, state, is_seed_asked=is_seed_asked)
        if old is None:
            _set_aside(home)
            _write_state(home, state)
        state = old or state
        commit = checkout.commit(root)
        began_s = time.monotonic()
        status, was_interrupted = _command(root, home, campaign, minutes, state.seed, say)
        took = (time.monotonic() - began_s) / 60
        _write_state(home, replace(state, minutes=state.minutes + took))
        changed = checkout.contents(root, campaign.covers) != state.contents
        if changed and not commit.endswith(page.DIRTY):
            commit += page.DIRTY
        progress = Progress.read(home / "round")
        outcome = Outcome(
            campaign.name,
            _result(status, progress, was_interrupted=was_interrupted),
            *(took, commit, state.seed, str(home / "round")),
            failed=progress.failed if progress else (),
            was_interrupted=was_interrupted,
        )
        _keep(root, outcome, state.minutes + took)
    return outcome


def _goes_on(root: Path, campaign: Campaign, new: State, *, is_seed_asked: bool) -> State | None:
    """The state of the round that goes on; None: a new one begins."""
    file = root / FOLDER / campaign.name / "state.json"
    old = State(**json.loads(file.read_text())) if file.exists() else None
    if old is None or old.contents != new.contents or _is_over(root, campaign):
        return None
    return None if is_seed_asked and old.seed != new.seed else old


def _is_over(root: Path, campaign: Campaign) -> bool:
    """Whether the round is whole, and was either counted for this commit or has failed."""
    progress = Progress.read(root / FOLDER / campaign.name / "round")
    if progress is None or not progress.is_whole:
        return False
    (age,) = (age for age in ages(root) if age.campaign == campaign.name)
    return bool(progress.failed) or age.is_current


def _set_aside(home: Path) -> None:
    """Remove the former round; one in which something failed is kept."""
    former = home / "round"
    progress = Progress.read(former)
    if progress is not None and progress.failed:
        moment = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
        former.rename(home / f"failed-{moment}")
    elif former.exists():
        shutil.rmtree(former)


def _write_state(home: Path, state: State) -> None:
    (home / "state.json").write_text(json.dumps(asdict(state)))


def _command(
    root: Path,
    home: Path,
    campaign: Campaign,
    minutes: float | None,
    seed: int,
    say: Callable[[str], None],
) -> tuple[int, bool]:
    """Its exit status, and whether it was interrupted.

    What it says goes on as it comes; what daemons write to standard error is in the log only.
    """
    for folder in ("round", "keep"):
        (home / folder).mkdir(exist_ok=True)
    words = campaign.arguments(minutes, seed=seed, folder=home / "round", keep=home / "keep")
    command = [sys.executable, *words]
    # In a separate process group: Ctrl-C comes from here, once.
    with (
        (home / "log").open("w", encoding="utf-8") as log,
        subprocess.Popen(
            command,
            cwd=root,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            errors="replace",
            start_new_session=True,
        ) as process,
    ):
        assert process.stdout is not None
        try:
            _pass_on(process.stdout, log, say)
            return process.wait(), False
        except KeyboardInterrupt:
            say("ending: what was done is kept")
            process.send_signal(signal.SIGINT)
            late = threading.Timer(ENDS_WITHIN_S, os.killpg, (process.pid, signal.SIGKILL))
            late.start()
            _pass_on(process.stdout, log, say)
            late.cancel()
            return process.wait(), True


def _pass_on(lines: Iterable[str], log: TextIO, say: Callable[[str], None]) -> None:
    for line in lines:
        log.write(line)
        log.flush()
        say(line.rstrip("\n"))


def _result(status: int, progress: Progress | None, *, was_interrupted: bool) -> str:
    if progress is not None and progress.failed:
        return page.FAILED
    if status != 0 and not was_interrupted:
        return page.FAILED
    if progress is None:
        return "0 of 1" if was_interrupted else page.PASSED
    return page.PASSED if progress.is_whole else str(progress)


def _keep(root: Path, outcome: Outcome, minutes: float) -> None:
    """Write it into the page: with the minutes of all runs of the round."""
    before = page.load(root).get(outcome.campaign)
    passed_at = before.passed_at if before is not None else ""
    if outcome.result == page.PASSED and not outcome.commit.endswith(page.DIRTY):
        passed_at = outcome.commit
    last = Last(
        result=outcome.result,
        commit=outcome.commit,
        date=datetime.now(UTC).date().isoformat(),
        minutes=max(1, round(minutes)),
        machine=f"{os.cpu_count()} × {platform.machine()}",
        command=f"./run campaign {outcome.campaign} --seed {outcome.seed}",
        passed_at=passed_at,
    )
    page.keep(root, outcome.campaign, last)
