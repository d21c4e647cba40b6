"""A robot whose mind runs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from tests.host.mind.robot import Robot

from nondum.host.mind.planners import Planners


@pytest.fixture
async def robot() -> AsyncIterator[Robot]:
    """Nothing is plugged in yet; the installed planners plan."""
    async with at_work(Robot(Planners.installed(memory_mb=512))) as robot:
        yield robot


@asynccontextmanager
async def at_work(robot: Robot) -> AsyncIterator[Robot]:
    """Have a robot's mind run."""
    running = asyncio.create_task(robot.mind.run())
    yield robot
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await robot.mind.close()
