"""One step removed in a copy of the checkout, and the tests that guard it run there."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from tests.mutation.runner import UNTOLD
from tests.mutation.steps import Step

_PORTIONS = ("host", "planning", "transport", "wheelhouse", "plugins/host-zenoh", "plugins/sdk")


def copies(root: Path, folder: Path, count: int) -> list[Copy]:
    """Copies of what git would take from a checkout, all the same even if somebody works in it."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=root, check=True, capture_output=True).stdout
    folders = [folder / str(number) for number in range(count)]
    for name in names.decode().split("\0"):
        if name and (root / name).is_file():
            (folders[0] / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folders[0] / name)
    for other in folders[1:]:
        shutil.copytree(folders[0], other)
    return [Copy(one) for one in folders]


class Copy:
    """A copy of the checkout, in which one step at a time is missing. To be used in `with`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._moments = itertools.count(1_000_000_000, 10)
        paths = os.pathsep.join(str(folder / portion) for portion in _PORTIONS)
        self._runner = subprocess.Popen(
            ["nice", "-n", "5", sys.executable, "-m", "tests.mutation.runner"],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": paths},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._runner.communicate()

    def first_failure(self, tests: Sequence[str]) -> str:
        """The first test that fails as the copy is now; empty when all pass."""
        assert self._runner.stdin is not None and self._runner.stdout is not None
        self._runner.stdin.write(json.dumps(tests) + "\n")
        self._runner.stdin.flush()
        failed: str | None = json.loads(self._runner.stdout.readline())
        return failed or ""

    def guard_of(self, step: Step, guards: Sequence[str], known: str = "") -> str:
        """The first test that fails without a step, the known one before all; empty when none."""
        file = self.folder / step.module
        whole = file.read_text(encoding="utf-8")
        try:
            self._write(file, step.removed(whole))
            if known and self.first_failure([known]) == known:
                return known
            failed = self.first_failure(guards)
            return failed if failed != UNTOLD else ""
        finally:
            self._write(file, whole)

    def _write(self, file: Path, text: str) -> None:
        """With a time that no version had before: Python recognises byte code by time and size."""
        file.write_text(text, encoding="utf-8")
        moment = next(self._moments)
        os.utime(file, (moment, moment))
