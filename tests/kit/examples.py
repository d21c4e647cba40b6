"""How many examples Hypothesis draws: the profile says it (tests/conftest.py)."""

from __future__ import annotations

from hypothesis import settings


def a_share(divisor: int) -> settings:
    """For a test whose examples cost much time: a share of the examples of the profile."""
    return settings(max_examples=settings().max_examples // divisor)
