"""The descriptors of this process: which are open, and how many more there may be."""

from __future__ import annotations

import contextlib
import itertools
import os
import resource
from collections.abc import Iterator
from pathlib import Path

STANDARD = 3
"""Those of a program from its start: below it no number is ever free."""


def open_descriptors() -> set[int]:
    """Those that are open; the one by which they are listed is gone again."""
    with os.scandir("/proc/self/fd") as entries:
        found = {int(entry.name) for entry in entries}
    return {number for number in found if Path(f"/proc/self/fd/{number}").exists()}


@contextlib.contextmanager
def descriptors_left(left: int) -> Iterator[None]:
    """This process may open only so many more (EMFILE): a new one is the lowest that is free.

    Where none is left, none is left either once others are closed, by threads for example.
    """
    used, (soft, hard) = open_descriptors(), resource.getrlimit(resource.RLIMIT_NOFILE)
    free = (number for number in itertools.count() if number not in used)
    limit = next(itertools.islice(free, left, None)) if left else STANDARD
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
