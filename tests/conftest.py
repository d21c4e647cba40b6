"""What every test may ask for."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, settings

# Whoever runs the tests has a machine of their own, and other work on it.
settings.register_profile("nondum", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("nondum")


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"
