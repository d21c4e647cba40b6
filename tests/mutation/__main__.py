"""Remove each step of verification in turn, and see a test fail: `python -m tests.mutation`.

What the page has already is not tried again, unless `--all` is given; then the guard that it names
is tried first. With `--folder`, those are tried whose module, or a file of its guards, has changed
since that was noted in the folder or in docs/reliability/verification.json: so it can be stopped
and goes on where it was, and a fresh checkout tries only what has changed. Exits with 1 when a step
has no guard.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import queue
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from tests.campaign.progress import Limit
from tests.mutation import page
from tests.mutation.guards import GUARDS, SPARED
from tests.mutation.page import Key
from tests.mutation.steps import Step, steps_in
from tests.mutation.trial import Copy, copies
from tests.mutation.tried import Tried

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
        every = page.keyed(steps_in(made[0].folder, tuple(GUARDS)))
        spared = {k: page.spared(SPARED[k[:2]]) for k in every if k[:2] in SPARED}
        steps = {key: step for key, step in every.items() if key not in spared}
        tried = (
            Tried(options.folder, options.keep or options.folder, made[0].folder, steps)
            if options.folder
            else None
        )
        limit = Limit(options.minutes)
        due = [
            key
            for key in steps
            if (tried.is_due(key) if tried else options.all or key not in known)
            and (options.only or "") in key.module
        ]
        due.sort(key=lambda key: key in known)
        guards = {**spared, **{key: known[key] for key in steps if key in known}}
        broken = 0
        with contextlib.suppress(KeyboardInterrupt):
            for number, (key, guard) in enumerate(_tried(made, steps, due, known, limit), start=1):
                if guard is None:
                    broken += 1
                else:
                    guards[key] = guard or page.MISSING
                    if tried:
                        tried.add(key, guard)
                told = "not tried" if guard is None else guards[key]
                sys.stdout.write(f"{limit} {number}/{len(due)} {steps[key].name}: {told}\n")
                sys.stdout.flush()
                _write(every, guards, page.took(before))
        if options.all and not options.only:
            minutes = round((time.monotonic() - began_s) / 60)
            told = f"All of them took {minutes} minutes on {len(made)} processors."
            _write(every, guards, told)
    if tried:
        sys.stdout.write(f"{tried.progress} tried, {len(tried.progress.failed)} without a guard\n")
        return 1 if tried.progress.failed or broken else 0
    missing = [key for key in due if guards.get(key, page.MISSING) == page.MISSING]
    sys.stdout.write(f"{len(steps)} steps, {len(due)} tried, {len(missing)} without a guard\n")
    return 1 if missing or broken else 0


def _write(steps: Iterable[Key], guards: Mapping[Key, str], took: str) -> None:
    listed = {key: guards[key] for key in steps if key in guards}
    page.PAGE.write_text(page.written(listed, took), encoding="utf-8")


def _tried(
    made: Sequence[Copy],
    steps: dict[Key, Step],
    due: list[Key],
    known: Mapping[Key, str],
    limit: Limit,
) -> Iterator[tuple[Key, str | None]]:
    """Each step that is due, with its guard, as they come; None where the guards fail although
    every step is in place."""
    idle: queue.Queue[Copy] = queue.Queue()
    for copy in made:
        idle.put(copy)
    failed: dict[tuple[str, ...], str] = {}
    looking = {GUARDS[key.module]: threading.Lock() for key in due}

    def failure(copy: Copy, guards: tuple[str, ...]) -> str:
        with looking[guards]:
            if guards not in failed:
                failed[guards] = copy.first_failure(guards)
                if failed[guards]:
                    told = f"error: fails with every step in place: {failed[guards]}\n"
                    sys.stdout.write(told)
            return failed[guards]

    def tried(key: Key) -> tuple[Key, str | None] | None:
        if limit.is_over:
            return None
        copy, guards = idle.get(), GUARDS[key.module]
        try:
            if failure(copy, guards):
                return key, None
            return key, copy.guard_of(steps[key], guards, known.get(key, ""))
        finally:
            idle.put(copy)

    with ThreadPoolExecutor(len(made)) as pool:
        yield from (told for told in pool.map(tried, due) if told is not None)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.mutation", description=__doc__)
    parser.add_argument("--all", action="store_true", help="try again what the page has")
    parser.add_argument("--only", metavar="TEXT", help="modules with this in their path")
    parser.add_argument("--minutes", type=float, help="how long to go on [until all is done]")
    parser.add_argument("--folder", type=Path, help="try all that was not noted there")
    parser.add_argument("--keep", type=Path, help="where that is noted [FOLDER]")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
