"""Which steps were tried, and with which text of their module and of its guards.

A module of which each step has a guard is kept in the repository, with the hash of these texts: a
checkout on another machine tries what has changed since, and nothing else.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tests.campaign.progress import Progress
from tests.mutation.guards import GUARDS
from tests.mutation.page import Key

GUARDED = Path(__file__).parents[2] / "docs/reliability/verification.json"
"""Module → hash of the texts with which a guard was found for each of its steps."""


class Tried:
    """Steps, the hash of what they were tried with, and what missed them."""

    def __init__(
        self, folder: Path, keep: Path, root: Path, steps: Iterable[Key], guarded: Path = GUARDED
    ) -> None:
        """`folder` gets the tally of this round, `keep` the steps that were tried, `guarded` the
        modules that are done; `root` is a checkout."""
        keep.mkdir(parents=True, exist_ok=True)
        self._folder, self._file, self._steps = folder, keep / "tried.json", tuple(steps)
        self._hashes = {module: _hash(root, module) for module in {k.module for k in self._steps}}
        self._found: dict[str, list[str]] = _read(self._file)
        self._guarded_file, self._guarded = guarded, _read(guarded)
        self.progress.write(folder)

    def is_due(self, key: Key) -> bool:
        """Whether it was not tried with the text that is there now."""
        hash_now = self._hashes[key.module]
        if self._guarded.get(key.module) == hash_now:
            return False
        return self._found.get(_name(key), [""])[0] != hash_now

    def add(self, key: Key, guard: str) -> None:
        """Note what missed the step; empty: nothing did."""
        self._found[_name(key)] = [self._hashes[key.module], guard]
        self._file.write_text(json.dumps(self._found))
        if all(self._is_guarded(one) for one in self._steps if one.module == key.module):
            self._guarded[key.module] = self._hashes[key.module]
            known = {name: self._guarded[name] for name in sorted(self._guarded.keys() & GUARDS)}
            self._guarded_file.write_text(json.dumps(known, indent=1) + "\n")
        self.progress.write(self._folder)

    @property
    def progress(self) -> Progress:
        """Of all steps that there are."""
        done = [key for key in self._steps if not self.is_due(key)]
        failed = [_name(key) for key in done if not self._is_guarded(key)]
        return Progress(len(self._steps), tuple(map(_name, done)), tuple(failed))

    def _is_guarded(self, key: Key) -> bool:
        """Whether a guard was found with the text that is there now."""
        hash_now = self._hashes[key.module]
        if self._guarded.get(key.module) == hash_now:
            return True
        found = self._found.get(_name(key), ["", ""])
        return found[0] == hash_now and bool(found[1])


def _read(file: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(file.read_text("utf-8")) if file.exists() else {}
    return found


def _name(key: Key) -> str:
    return f"{key.module}: {key.condition} ({key.number})"


def _hash(root: Path, module: str) -> str:
    told = hashlib.sha256()
    for test in GUARDS[module]:
        if "::" in test:  # another test of the same file may be a guard that those before were not
            told.update(test.encode())
    for name in dict.fromkeys([module, *(test.partition("::")[0] for test in GUARDS[module])]):
        files = sorted((root / name).rglob("*.py")) if (root / name).is_dir() else [root / name]
        for file in files:
            told.update(file.read_bytes())
    return told.hexdigest()[:16]
