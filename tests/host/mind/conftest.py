"""A robot whose mind runs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest
from tests.host.mind.robot import Robot

from nondum.host.mind.planners import Planners


@pytest.fixture
async def robot() -> AsyncIterator[Robot]:
    """Nothing is plugged in yet; the installed planners plan."""
    robot = Robot(Planners.installed(memory_mb=512))
    running = asyncio.create_task(robot.mind.run())
    yield robot
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await robot.mind.close()
