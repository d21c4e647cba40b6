"""What every test of this plugin may ask for."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import settings
from simulated_receiver import SimulatedReceiver

settings.register_profile("gps", deadline=None)
settings.load_profile("gps")
"""How fast examples are made says something of the machine."""


@pytest.fixture
def receiver() -> Iterator[SimulatedReceiver]:
    on_table = SimulatedReceiver()
    yield on_table
    on_table.unplug()
