"""Goals that lie on a drive outside every signature: each is a problem, and none is read."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from nondum.sdk.errors import Problem
from nondum.wheelhouse.format import goals
from nondum.wheelhouse.payload import drive

PLACES = (goals.NAME, f"{drive.FOLDER}/{goals.NAME}")


def loose_goals(root: Path) -> Iterator[Problem]:
    """A refusal for each (GOAL_UNSIGNED)."""
    for place in PLACES:
        if _is_there(root / place):
            yield Problem(
                "GOAL_UNSIGNED",
                "a goal lies beside the payloads, where no signature covers it: it is not read",
                where=place,
                fix="put it into a payload: `nondum payload goal WORDS -o DRIVE --sign KEY`",
            )


def _is_there(path: Path) -> bool:
    try:
        return bool(os.lstat(path))
    except OSError:
        return False
