"""One input given to one target, and what that cost."""

from __future__ import annotations

import resource
import time
from dataclasses import dataclass

from tests.fuzz.target import Target

from nondum.sdk.errors import NondumError

MOST_S = 1.0
MOST_BYTES = 256 * 1024**2


@dataclass(frozen=True, slots=True)
class Trial:
    """What became of an input."""

    refused: str
    """The code that it was refused with; empty: it was read."""
    cpu_s: float
    grown_bytes: int
    """By how much the process's peak grew meanwhile."""

    @property
    def is_within_bounds(self) -> bool:
        return self.cpu_s <= MOST_S and self.grown_bytes <= MOST_BYTES


def tried(target: Target, data: bytes) -> Trial:
    """Have an input read. Whatever is no error of nondum's tree goes on to the caller."""
    peak, begun = _peak_bytes(), time.process_time()
    try:
        target.read(data)
        refused = ""
    except NondumError as error:
        refused = error.code
    return Trial(refused, time.process_time() - begun, _peak_bytes() - peak)


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
