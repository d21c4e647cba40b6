"""Chance, which can be had again: the seed is printed, and may be given."""

from __future__ import annotations

import os
import random

import pytest
from tests.daemon.peer_faults.crew import note


@pytest.fixture
def seed() -> int:
    """`NONDUM_SEED`, or another one each time; pytest shows it when the test fails."""
    given = os.environ.get("NONDUM_SEED")
    seed = int(given) if given else random.SystemRandom().randrange(1_000_000)
    note(f"NONDUM_SEED={seed}")
    return seed
