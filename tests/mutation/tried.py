"""Which steps were tried, and with which text of their module and of its guards."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path

from tests.campaign.rounds import Tally
from tests.mutation.guards import GUARDS
from tests.mutation.page import Key


class Tried:
    """A file of steps, the hash of what they were tried with, and what missed them."""

    def __init__(self, folder: Path, keep: Path, root: Path, steps: Iterable[Key]) -> None:
        """`folder` gets the tally of this round, `keep` the file; `root` is a checkout."""
        keep.mkdir(parents=True, exist_ok=True)
        self._folder, self._file, self._steps = folder, keep / "tried.json", tuple(steps)
        self._hashes = {module: _hash(root, module) for module in GUARDS}
        self._found: dict[str, list[str]] = (
            json.loads(self._file.read_text()) if self._file.exists() else {}
        )
        self.tally.write(folder)

    def is_due(self, key: Key) -> bool:
        """Whether it was not tried with the text that is there now."""
        return self._found.get(_name(key), [""])[0] != self._hashes[key.module]

    def add(self, key: Key, guard: str) -> None:
        """Note what missed the step; empty: nothing did."""
        self._found[_name(key)] = [self._hashes[key.module], guard]
        self._file.write_text(json.dumps(self._found))
        self.tally.write(self._folder)

    @property
    def tally(self) -> Tally:
        """Of all steps that there are."""
        done = [_name(key) for key in self._steps if not self.is_due(key)]
        return Tally(len(self._steps), tuple(done), tuple(n for n in done if not self._found[n][1]))


def _name(key: Key) -> str:
    return f"{key.module}: {key.condition} ({key.number})"


def _hash(root: Path, module: str) -> str:
    told = hashlib.sha256()
    for name in dict.fromkeys([module, *(test.partition("::")[0] for test in GUARDS[module])]):
        files = sorted((root / name).rglob("*.py")) if (root / name).is_dir() else [root / name]
        for file in files:
            told.update(file.read_bytes())
    return told.hexdigest()[:16]
