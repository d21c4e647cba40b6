"""What a job process tells of its job before the answer, and how long what it tells may be."""

from __future__ import annotations

from dataclasses import dataclass

LONGEST = 16 * 1024 * 1024
"""Bytes of a message between the daemon and a job process."""
BEGUN = "begun"
"""The event that the job has been loaded and begins."""
PROGRESS = "progress"
"""The event that it is so far (`Progress`)."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a job is."""

    phase: str
    done: int
    total: int
