"""`./run lab`: whole machines, booted and used; see docs/lab.md."""

from __future__ import annotations

import argparse
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.campaign.progress import Limit, Round, work_off
from tests.kit.payloads import sdk_wheel
from tests.lab.building import built
from tests.lab.lab import Lab
from tests.lab.recipe import ARCHITECTURES, PYTHONS, X86_64, recipe
from tests.lab.scenario import SHORT, Result, Scenario, keep, run, scenarios
from tests.lab.shell import talk
from tests.lab.software import software


def main(words: Sequence[str]) -> int:
    """Run what is asked for; answers the exit status."""
    known = scenarios()
    asked = _arguments(known, words)
    if asked.list:
        width = max(map(len, known))
        print(*(f"{s.name:{width}}  {s.sentence}" for s in known.values()), sep="\n")
        return 0
    began = time.monotonic()
    machine = built(recipe(asked.arch, asked.suite))
    _told("the machine is built", began)
    began = time.monotonic()
    disk = software(machine, asked.commit)
    _told("nondum is built for it", began)
    sdk_wheel()  # before two of them would make it at the same time
    work = Path(tempfile.mkdtemp(prefix="nondum-lab-"))
    labs = []
    for number in range(asked.jobs):
        (folder := work / str(number)).mkdir()
        is_alone = asked.jobs == 1
        labs.append(Lab(machine, disk, asked.commit, folder, asked.payload, is_alone))
    try:
        if asked.shell:
            return talk(labs[0])
        names = asked.scenario or (SHORT if asked.short else list(known))
        due = Round(asked.folder or work, names, Limit(asked.minutes), say=lambda _: None)
        return _run(labs, known, due, asked)
    finally:
        for lab in labs:
            lab.close()
        shutil.rmtree(work)


def _run(labs: list[Lab], known: dict[str, Scenario], due: Round, asked: argparse.Namespace) -> int:
    results = []
    ended = threading.Event()

    def try_one(number: int, name: str) -> None:
        lab = labs[number]
        result = run(known[name], lab)
        if ended.is_set():  # its machines were switched off
            return
        results.append(result)
        due.add(name, passed=not result.failure)
        _show(result, f"{due.limit} {due.progress}  " if asked.folder else "")
        if asked.keep and result.kept is None:
            print(f"    kept: {keep(name, lab)}")

    def end() -> None:
        ended.set()
        for lab in labs:
            lab.close()

    def some(*, is_alone: bool) -> Iterator[str]:
        names = due.due() if asked.folder else iter(due.pieces)
        return (name for name in names if known[name].is_alone is is_alone)

    work_off(some(is_alone=False), len(labs), try_one, end)
    for lab in labs[1:]:
        lab.close()
    work_off(some(is_alone=True), 1, try_one, end)
    failed = sum(1 for r in results if r.failure)
    for result in results:
        if result.failure:
            print(f"\n{result.scenario.name}\n{result.failure}\nkept: {result.kept}")
    boots = ", ".join(f"{seconds:.0f}" for lab in labs for seconds in lab.boots_s)
    replugs = sum(result.replugs for result in results)
    print(f"\nboots: {boots} s; drives plugged in again because they stalled: {replugs}")
    print(f"{len(results) - failed} passed, {failed} failed")
    return 1 if due.progress.failed else 0


def _show(result: Result, head: str) -> None:
    mark = "FAILED" if result.failure else "passed"
    times = f"{result.seconds:5.0f} s  {result.cpu_s:5.0f} s cpu"
    told = [result.note, f"replugs: {result.replugs}" if result.replugs else ""]
    note = "; ".join(filter(None, told))
    print(f"{head}{mark}  {times}  {result.scenario.name:14}  {note}", flush=True)


def _told(what: str, began: float) -> None:
    print(f"{what}: {time.monotonic() - began:.0f} s", flush=True)


def _arguments(known: dict[str, Scenario], words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./run lab", description="Whole machines under test.")
    parser.add_argument(
        "scenario", nargs="*", metavar="SCENARIO", help="which ones (all)", choices=[*known, []]
    )
    parser.add_argument(
        "--arch", choices=ARCHITECTURES, default=X86_64.name, help="its processor (%(default)s)"
    )
    parser.add_argument(
        "--suite", choices=PYTHONS, default=X86_64.suite, help="its Debian (%(default)s)"
    )
    parser.add_argument("--payload", type=Path, metavar="DIR", help="what `payload` plugs in")
    parser.add_argument("--list", action="store_true", help="tell which scenarios there are")
    parser.add_argument("--short", action="store_true", help=f"only {', '.join(SHORT)}")
    parser.add_argument("--minutes", type=float, help="begin no further scenario after so long")
    parser.add_argument("--folder", type=Path, help="what was done so far: that is not done again")
    parser.add_argument(
        "--jobs", type=int, default=1, choices=range(1, 9), help="scenarios at the same time"
    )
    parser.add_argument("--keep", action="store_true", help="keep consoles and journals of all")
    parser.add_argument("--commit", help="nondum as of a commit, not as the checkout is now")
    parser.add_argument("--shell", action="store_true", help="boot one and run what you type")
    return parser.parse_args(words)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that all is switched off
    sys.exit(main(sys.argv[1:]))
