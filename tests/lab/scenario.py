"""Scenarios: one file each, found by their names, run one after the other."""

from __future__ import annotations

import importlib
import shutil
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.lab.agent import MachineSilent
from tests.lab.cache import cache_folder
from tests.lab.lab import Lab

FOLDER = Path(__file__).parent / "scenarios"
PACKAGE = "tests.lab.scenarios"
SHORT = ("yank",)
"""Those that every change is tried with (`./run tests`). It sees all that `starts` and `stick` see:
the machine boots, the service starts, a stick works, is pulled, and nothing of it is left."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """Something that must hold on a real machine."""

    name: str
    sentence: str
    """What holds."""
    run: Callable[[Lab], str | None]
    """Does it; answers what is worth saying of it, and raises when it does not hold."""
    is_alone: bool = False
    """Whether no other runs beside it: it holds the robot to what is promised in seconds."""


@dataclass(frozen=True, slots=True)
class Result:
    """How one went."""

    scenario: Scenario
    seconds: float
    cpu_s: float
    """Processor time of its machines: what it takes however many others there are."""
    note: str
    """Of one that failed: why, in a line."""
    replugs: int = 0
    """How often a drive was plugged in again, because the processors had no time for it."""
    failure: str = ""
    kept: Path | None = None
    """Where consoles and journals of a failed one are."""


def scenarios() -> dict[str, Scenario]:
    """All there are, by name."""
    return {s.name: s for s in map(_loaded, sorted(FOLDER.glob("[a-z]*.py")))}


def run(scenario: Scenario, lab: Lab) -> Result:
    """Run a scenario, and switch off what it used alone, and if it failed, all that it used."""
    began, before_s, replugs = time.monotonic(), lab.cpu_s(), lab.replugs()
    note, failure, kept = "", "", None
    try:
        with lab.scenario():
            note, failure, kept = _run(scenario, lab)
            if failure:
                raise _Failed
    except _Failed:
        pass
    spent_s = lab.cpu_s() - before_s
    took_s, again = time.monotonic() - began, lab.replugs() - replugs
    return Result(scenario, took_s, spent_s, note, again, failure, kept)


class _Failed(Exception):
    """Has the laboratory switch off what a failed scenario used."""


def _run(scenario: Scenario, lab: Lab) -> tuple[str, str, Path | None]:
    try:
        return scenario.run(lab) or "", "", None
    except Exception as error:
        words = str(error).strip().splitlines() or [type(error).__name__]
        kept = keep(scenario.name, lab)
        return words[0], "".join(traceback.format_exception(error)), kept


def keep(name: str, lab: Lab) -> Path:
    """Copy consoles, commands and journals to where they stay, in place of those of last time."""
    folder = cache_folder() / "kept" / lab.built.recipe.name / name
    shutil.rmtree(folder, ignore_errors=True)
    for number, machine in enumerate(lab.machines):
        target = folder / str(number)
        target.mkdir(parents=True)
        for log in machine.work.glob("*.log"):
            shutil.copy(log, target)
        try:
            journal = machine.run("journalctl -b --no-pager -o short-monotonic")
        except (MachineSilent, AssertionError, OSError) as error:
            journal = f"{error}\n"
        (target / "journal.log").write_text(journal, encoding="utf-8")
    return folder


def _loaded(path: Path) -> Scenario:
    module = importlib.import_module(f"{PACKAGE}.{path.stem}")
    sentence = (module.__doc__ or "").strip().splitlines()[0]
    is_alone = getattr(module, "ALONE", False)
    return Scenario(path.stem.replace("_", "-"), sentence, module.run, is_alone)
