"""The seam to who can say whether a payload's source folder makes a payload that hosts take.

The SDK knows neither manifests nor PDDL. Who does has an entry point in group `nondum.checks`,
which loads to a function of the folder that gives what is wrong; nondum itself has one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import TypeAlias

from nondum.sdk.errors import PayloadRefused, Problem

GROUP = "nondum.checks"
MANIFEST = "payload.toml"

Check: TypeAlias = Callable[[Path], Sequence[Problem]]
"""What is wrong with a payload's source folder. The plugins are imported in this process."""


def check(folder: Path) -> None:
    """Have a payload's source folder checked by all who are installed.

    Raises `PayloadRefused` with everything that is wrong, or with CHECK_MISSING.
    """
    installed = metadata.entry_points(group=GROUP)
    if not installed:
        text = "nothing is installed here that can check it"
        raise PayloadRefused(Problem("CHECK_MISSING", text, where=str(folder)))
    checks: list[Check] = [found.load() for found in installed]
    if problems := [problem for judge in checks for problem in judge(folder)]:
        raise PayloadRefused(*problems)


def source_folder(file: Path) -> Path:
    """The nearest folder above a file that is a payload's source; without one, the file's own."""
    above = (folder for folder in file.parents if (folder / MANIFEST).is_file())
    return next(above, file.parent)
