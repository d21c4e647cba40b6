"""What every test may ask for."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from tests.kit.clock import VirtualClock

# Whoever runs the tests has a machine of their own, and other work on it.
settings.register_profile("nondum", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("nondum")


@pytest.fixture
def anyio_backend(request: pytest.FixtureRequest) -> str | tuple[str, dict[str, Any]]:
    """asyncio; its time is virtual for a test that asks for `clock`."""
    if "clock" in request.fixturenames:
        return "asyncio", {"loop_factory": VirtualClock}
    return "asyncio"


@pytest.fixture
async def clock(anyio_backend: object) -> VirtualClock:
    """The event loop of the test, whose time the test advances."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualClock)
    return loop
