"""What every test may ask for."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from tests.kit.clock import VirtualClock

pytest_plugins = ["tests.kit.evidence", "tests.kit.golden", "tests.runner.plugin"]

_QUIET = [HealthCheck.too_slow]
"""How fast examples are made says something of the machine, nothing of nondum."""

# One commit is one test: the full run draws the same examples each time, a campaign other ones.
settings.register_profile(
    "gate", deadline=None, derandomize=True, database=None, suppress_health_check=_QUIET
)
settings.register_profile("quick", settings.get_profile("gate"), max_examples=20)
settings.register_profile(
    "campaign", deadline=None, max_examples=1000, print_blob=True, suppress_health_check=_QUIET
)
settings.load_profile("gate")


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
