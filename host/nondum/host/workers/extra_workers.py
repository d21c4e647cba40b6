"""Workers beside those that stand for their components: tried, or being stopped."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any, TypeAlias

from nondum.host.workers.role import Role
from nondum.host.workers.supervisor import Supervisor

Granted: TypeAlias = dict[str, dict[str, Any]]
"""Declared need → node and properties of the device that serves it, and all its `nodes`."""


class ExtraWorkers:
    """Knows them, and which devices those that are being stopped still have."""

    def __init__(self) -> None:
        self._devices: dict[Supervisor, Granted] = {}

    def __iter__(self) -> Iterator[Supervisor]:
        """All of them."""
        return iter(tuple(self._devices))

    def add(self, supervisor: Supervisor, devices: Granted | None = None) -> None:
        """Take one in, with what it has until it has ended."""
        self._devices[supervisor] = devices or {}

    def drop(self, supervisor: Supervisor) -> None:
        """One is not among them any more, if it was."""
        self._devices.pop(supervisor, None)

    def get(self, component: str, payload: str) -> Supervisor | None:
        """That which a payload has for a component; without a payload, none."""
        mine = (o for o in self if o.spec.component == component and o.spec.payload == payload)
        return next(mine, None)

    def beside(self, component: str, payload: str) -> Supervisor | None:
        """That which may take over for a component."""
        found = self.get(component, payload)
        return found if found is not None and found.role is Role.BESIDE else None

    async def left(self, component: str) -> None:
        """Wait until those that stood for a component have ended; somebody else stops them."""
        await self._ended(
            o for o in self if o.spec.component == component and o.role is Role.LEAVING
        )

    async def released(self, node: str) -> None:
        """Wait until none has a device node any more."""
        await self._ended(
            other
            for other, devices in tuple(self._devices.items())
            if any(node == each["node"] for device in devices.values() for each in device["nodes"])
        )

    async def _ended(self, some: Iterator[Supervisor]) -> None:
        await asyncio.gather(*(supervisor.ended() for supervisor in some))
