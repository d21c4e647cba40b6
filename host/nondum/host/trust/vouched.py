"""Who vouches for a payload that is here, as people are shown it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Vouched:
    """What is known of it, as far as it was asked."""

    signers: tuple[str, ...] = ()
    """Names, or fingerprints of keys that have none."""
    built: str = ""
    """When they say that it was built: UTC, ISO 8601."""


NOBODY = Vouched()
