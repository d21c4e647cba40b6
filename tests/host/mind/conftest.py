"""A robot whose mind runs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from tests.host.mind.robot import Robot

from nondum.host.mind.planners import Planners

NATIVE = "nondum.host.mind.native_planner:NativePlanner"


@pytest.fixture
async def robot() -> AsyncIterator[Robot]:
    """Nothing is plugged in yet; the host's own planner plans. Of several, whichever is first wins:
    that is for test_planners and for whole daemons."""
    async with at_work(Robot(Planners.of({"native": NATIVE}, memory_mb=512))) as robot:
        yield robot


@asynccontextmanager
async def at_work(robot: Robot) -> AsyncIterator[Robot]:
    """Have a robot's mind run."""
    running = asyncio.create_task(robot.mind.run())
    yield robot
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await robot.mind.close()
