"""What the demonstration reports: phases of every stage, and whether its goal was reached."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

WIDTH = 98


@dataclass(frozen=True, slots=True)
class StageResult:
    """How one stage went."""

    name: str
    goal: str
    phases_s: Mapping[str, float]
    """Phase → seconds after the first drive went in."""
    published_s: float | None
    """Time of the published system for the same stage, a person's work included; None: it has no
    such stage."""
    reached: bool
    measure: str
    """What was measured, and the bound that it was held to."""
    plan: Sequence[str] = ()
    told: Sequence[str] = field(default_factory=tuple)
    """What the host announced during the stage without being asked."""


def as_text(results: Sequence[StageResult], *, phases: Sequence[str], note: str) -> str:
    """The table that people read; `note` says what its seconds are."""
    head = ["stage", *phases, "published", "reached"]
    rows = [
        [
            result.name,
            *(_seconds(result.phases_s.get(phase)) for phase in phases),
            "-" if result.published_s is None else f"{result.published_s:.0f} s *",
            "yes" if result.reached else "NO",
        ]
        for result in results
    ]
    widths = [max(len(line[i]) for line in [head, *rows]) for i in range(len(head))]
    lines = [
        "  ".join(f"{v:<{w}}" for v, w in zip(line, widths, strict=True)).rstrip()
        for line in [head, *rows]
    ]
    lines.insert(1, "-" * len(lines[0]))
    measures = [_wrapped(f"{result.name}: {result.measure}") for result in results]
    return "\n".join([*lines, "", *measures, "", _wrapped(f"* {note}")])


def as_data(
    results: Sequence[StageResult], *, reached: bool, note: str, **more: Any
) -> dict[str, Any]:
    """The same as one JSON document, with `more` that belongs in it; `reached`: all of it was."""
    return {
        **more,
        "reached": reached,
        "note": note,
        "stages": [asdict(result) for result in results],
    }


def _wrapped(text: str) -> str:
    return textwrap.fill(text, WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} s"
