"""What is known of one code."""

from __future__ import annotations

from nondum.sdk.frozen import frozen


@frozen
class Code:
    """A code that refusals may carry, the same from version to version."""

    name: str
    meaning: str
    """One sentence."""
    remedy: str
    """What a person can do about it. It is told with every problem of this code that does not say
    something better, with the names of the case."""
    causes: str = ""
    """What it usually comes from, where that is not plain."""
    is_told: bool = True
    """Whether problems tell the remedy by themselves; not where many reasons are told together, and
    what would help is told once for all."""
