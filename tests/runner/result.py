"""What became of one test, and how a run writes it down."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class Result:
    """One test of one pytest session."""

    test: str
    """Its node id, relative to the checkout."""
    outcome: str
    """passed, failed or skipped."""
    seconds: float
    """Of set-up, call and tear-down, in wall-clock time."""
    folder: str = ""
    """The temporary folder of a test that failed."""
    reason: str = ""
    """Why it was skipped."""
    message: str = ""
    """What pytest says about a failure."""

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def write(file: Path, results: Iterable[Result]) -> None:
    """Write results to a file of JSON lines, in place of what it had."""
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = (json.dumps(one.to_dict()) + "\n" for one in results)
    file.write_text("".join(lines), encoding="utf-8")


def read(file: Path) -> tuple[Result, ...]:
    """The results that a session wrote. Nothing, if it died before it wrote any."""
    if not file.exists():
        return ()
    lines = file.read_text(encoding="utf-8").splitlines()
    return tuple(Result(**json.loads(line)) for line in lines)
