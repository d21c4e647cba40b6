"""Remove each step of verification in turn, and see a test fail: `python -m tests.mutation`.

What the page has already is not tried again, unless `--all` is given; then the guard that it names
is tried first. Exits with 1 when a step has no guard.
"""

from __future__ import annotations

import argparse
import os
import queue
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from tests.mutation import page
from tests.mutation.guards import GUARDS
from tests.mutation.page import Key
from tests.mutation.steps import Step, steps_in
from tests.mutation.trial import Copy, copies

ROOT = Path(__file__).parents[2]


def main() -> int:
    """Try the steps, write the page."""
    options = _options()
    before = page.PAGE.read_text("utf-8") if page.PAGE.exists() else ""
    known, began_s = page.read(before), time.monotonic()
    known = {key: guard for key, guard in known.items() if guard != page.MISSING}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="nondum-mutation-")))
        folder.chmod(0o755)  # some tests are other users
        made = [stack.enter_context(copy) for copy in copies(ROOT, folder, os.cpu_count() or 1)]
        steps = page.keyed(steps_in(made[0].folder, tuple(GUARDS)))
        due = [
            key
            for key in steps
            if (options.all or key not in known) and (options.only or "") in key.module
        ]
        due.sort(key=lambda key: key in known)
        guards = {key: known[key] for key in steps if key in known}
        for number, (key, guard) in enumerate(_tried(made, steps, due, known), start=1):
            guards[key] = guard or page.MISSING
            sys.stdout.write(f"{number}/{len(due)} {steps[key].name}: {guards[key]}\n")
            sys.stdout.flush()
            _write(steps, guards, page.took(before))
        if options.all and not options.only:
            minutes = round((time.monotonic() - began_s) / 60)
            told = f"All of them took {minutes} minutes on {len(made)} processors."
            _write(steps, guards, told)
    missing = [key for key in due if guards.get(key, page.MISSING) == page.MISSING]
    sys.stdout.write(f"{len(steps)} steps, {len(due)} tried, {len(missing)} without a guard\n")
    return 1 if missing else 0


def _write(steps: Iterable[Key], guards: Mapping[Key, str], took: str) -> None:
    listed = {key: guards[key] for key in steps if key in guards}
    page.PAGE.write_text(page.written(listed, took), encoding="utf-8")


def _tried(
    made: Sequence[Copy], steps: dict[Key, Step], due: list[Key], known: Mapping[Key, str]
) -> Iterator[tuple[Key, str]]:
    """Each step that is due, with its guard, as they come."""
    idle: queue.Queue[Copy] = queue.Queue()
    for copy in made:
        idle.put(copy)

    def failure(guards: tuple[str, ...]) -> str:
        copy = idle.get()
        try:
            return copy.first_failure(guards)
        finally:
            idle.put(copy)

    def tried(key: Key) -> tuple[Key, str]:
        copy = idle.get()
        try:
            return key, copy.guard_of(steps[key], GUARDS[key.module], known.get(key, ""))
        finally:
            idle.put(copy)

    with ThreadPoolExecutor(len(made)) as pool:
        every = tuple(dict.fromkeys(GUARDS[key.module] for key in due))
        failed = dict(zip(every, pool.map(failure, every), strict=True))
        for test in filter(None, failed.values()):
            sys.stdout.write(f"error: fails with every step in place: {test}\n")
        yield from pool.map(tried, [key for key in due if not failed[GUARDS[key.module]]])


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.mutation", description=__doc__)
    parser.add_argument("--all", action="store_true", help="try again what the page has")
    parser.add_argument("--only", metavar="TEXT", help="modules with this in their path")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
