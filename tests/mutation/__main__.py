"""Remove each step of verification in turn, and see a test fail: `python -m tests.mutation`.

What the page has already is not tried again, unless `--all` is given. Exits with 1 when a step has
no guard.
"""

from __future__ import annotations

import argparse
import os
import queue
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.mutation import page
from tests.mutation.guards import GUARDS
from tests.mutation.page import Key
from tests.mutation.steps import Step, steps_in
from tests.mutation.trial import Copy

ROOT = Path(__file__).parents[2]


def main() -> int:
    """Try the steps, write the page."""
    options = _options()
    steps = page.keyed(steps_in(ROOT, tuple(GUARDS)))
    known = page.read(page.PAGE.read_text("utf-8")) if page.PAGE.exists() else {}
    old = {key: known[key] for key in steps if key in known and known[key] != page.MISSING}
    due = [
        key
        for key in steps
        if (options.all or key not in old) and (options.only or "") in key.module
    ]
    guards = {**old}
    with tempfile.TemporaryDirectory(prefix="nondum-mutation-") as folder:
        for number, (key, guard) in enumerate(_tried(Path(folder), steps, due), start=1):
            guards[key] = guard or page.MISSING
            sys.stdout.write(f"{number}/{len(due)} {steps[key].name}: {guards[key]}\n")
            sys.stdout.flush()
            listed = {key: guards[key] for key in steps if key in guards}
            page.PAGE.parent.mkdir(exist_ok=True)
            page.PAGE.write_text(page.written(listed), encoding="utf-8")
    return 1 if page.MISSING in guards.values() else 0


def _tried(folder: Path, steps: dict[Key, Step], due: list[Key]) -> Iterator[tuple[Key, str]]:
    """Each step that is due, with its guard, as they come."""
    count = os.cpu_count() or 1
    copies: queue.Queue[Copy] = queue.Queue()
    for number in range(count):
        copies.put(Copy(ROOT, folder / str(number)))
    first = copies.get()
    for guarding in dict.fromkeys(GUARDS[key.module] for key in due):
        if failed := first.first_failure(guarding):
            sys.exit(f"error: fails with every step in place: {failed}")
    copies.put(first)

    def tried(key: Key) -> tuple[Key, str]:
        copy = copies.get()
        try:
            return key, copy.guard_of(steps[key], GUARDS[key.module])
        finally:
            copies.put(copy)

    with ThreadPoolExecutor(count) as pool:
        yield from pool.map(tried, due)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.mutation", description=__doc__)
    parser.add_argument("--all", action="store_true", help="try again what the page has")
    parser.add_argument("--only", metavar="TEXT", help="modules with this in their path")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
