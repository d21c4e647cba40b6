"""The descriptors of this process: which are open, and how many more there may be."""

from __future__ import annotations

import contextlib
import itertools
import os
import resource
from collections.abc import Iterator
from pathlib import Path

STANDARD = 3
"""A program has standard input, output and error from its start: numbers below this are in use."""


def open_descriptors() -> set[int]:
    """Those that are open; the one by which they are listed is gone again."""
    with os.scandir("/proc/self/fd") as entries:
        found = {int(entry.name) for entry in entries}
    return {number for number in found if Path(f"/proc/self/fd/{number}").exists()}


@contextlib.contextmanager
def descriptors_left(left: int) -> Iterator[None]:
    """Lower RLIMIT_NOFILE until the kernel refuses this process all descriptors but `left` more
    (EMFILE): it gives each new one the lowest number that is free, and none from the limit on.

    Descriptors that other threads close meanwhile come on top of `left`, but for 0: then the limit
    is below all of them.
    """
    used, (soft, hard) = open_descriptors(), resource.getrlimit(resource.RLIMIT_NOFILE)
    free = (number for number in itertools.count() if number not in used)
    limit = next(itertools.islice(free, left, None)) if left else STANDARD
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
