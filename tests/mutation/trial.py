"""One step removed in a copy of the checkout, and the tests that guard it run there."""

from __future__ import annotations

import itertools
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.mutation.steps import Step

ROOMS = ("host", "planning", "transport", "wheelhouse", "plugins/sdk")
LIMIT_S = 300
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


class Copy:
    """A copy of the checkout, in which one step at a time is missing."""

    def __init__(self, root: Path, folder: Path) -> None:
        self._root, self._folder = root, folder
        self._moments = itertools.count(1_000_000_000, 10)
        if folder.exists():
            shutil.rmtree(folder)
        listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        names = subprocess.run(listed, cwd=root, check=True, capture_output=True).stdout
        for name in names.decode().split("\0"):
            if name and (root / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, folder / name)

    def first_failure(self, guards: Sequence[str]) -> str:
        """The first test that fails as the copy is now; empty when all pass."""
        paths = os.pathsep.join(str(self._folder / room) for room in ROOMS)
        done = subprocess.run(
            [*(sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"), *guards],
            cwd=self._folder,
            env={**os.environ, "PYTHONPATH": paths},
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
        if done.returncode == 0:
            return ""
        failed = _FAILED.search(done.stdout)
        return failed[1] if failed else "the tests do not begin"

    def guard_of(self, step: Step, guards: Sequence[str]) -> str:
        """The first test that fails without a step; empty when none misses it."""
        file = self._folder / step.module
        whole = (self._root / step.module).read_text(encoding="utf-8")
        try:
            self._write(file, step.removed(whole))
            return self.first_failure(guards)
        finally:
            self._write(file, whole)

    def _write(self, file: Path, text: str) -> None:
        """With a time of its own: byte code is told from another by time and size."""
        file.write_text(text, encoding="utf-8")
        moment = next(self._moments)
        os.utime(file, (moment, moment))
