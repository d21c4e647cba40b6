"""Skips that are known, each with the hardware that it needs: tests/hardware.toml."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.runner import toml_file
from tests.runner.result import Result

FILE = Path(__file__).parents[1] / "hardware.toml"


@dataclass(frozen=True, slots=True)
class KnownSkip:
    """Tests that cannot run on every machine."""

    test: str
    """A pattern of node ids (fnmatch); `[` stands for itself."""
    missing: str
    """The hardware or the privilege without which they are skipped."""
    reason: str

    def covers(self, result: Result) -> bool:
        """Whether this skip is the one that is known."""
        return fnmatch.fnmatchcase(result.test, self.test.replace("[", "[[]"))


def read(file: Path = FILE) -> tuple[KnownSkip, ...]:
    """Read the list."""
    return tuple(KnownSkip(**row) for row in toml_file.load(file).get("skip", []))


def refused(
    skipped: Iterable[Result], known: Sequence[KnownSkip], environment: Mapping[str, str]
) -> tuple[Result, ...]:
    """The skipped tests that fail a run: in CI, those that the list does not have."""
    return unknown(skipped, known) if environment.get("CI") else ()


def unknown(skipped: Iterable[Result], known: Sequence[KnownSkip]) -> tuple[Result, ...]:
    """The skipped tests that the list does not have."""
    return tuple(one for one in skipped if not any(skip.covers(one) for skip in known))
