"""Which nodes of devices a worker can open: granted by the need that they serve, and withdrawn."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from nondum.host.core.events.event import Emit
from nondum.host.core.events.workers import WorkerLogged
from nondum.host.sandbox.helper.grants import TIMES, reachable, withdrawn
from nondum.host.workers.device_ownership import DeviceOwnership
from nondum.host.workers.leftovers import clear_away
from nondum.host.workers.process import WorkerProcess, names_of
from nondum.sdk.errors import WorkerFailed


class DeviceAccess:
    """Of one worker."""

    def __init__(self, component: str, process: WorkerProcess, emit: Emit) -> None:
        self._component, self._process, self._emit = component, process, emit
        self._reached: set[str] = set()
        """Names by which a node may have been made for it, to be removed with it."""
        self._granted: dict[str, dict[str, str]] = {}
        """Need → name → node that it has by that name."""
        self._lending = DeviceOwnership(process.user)

    async def let_in(
        self, need: str, device: Mapping[str, Any], *, times: int = TIMES
    ) -> dict[str, Any]:
        """Have a device's nodes where the worker can open them, and no others that it had for that
        need; what it is told of that. A helper that does not answer is asked `times`."""
        names = dict(zip(names_of(need, device["nodes"]), device["nodes"], strict=True))
        had = self._granted.get(need, {})
        for name in tuple(had):
            if name not in names or had[name] != names[name]["node"]:
                del had[name]
                await self._shut_out(name)
        inside = [
            {**n, "node": await self._open_up(need, name, n, times)} for name, n in names.items()
        ]
        return {**inside[0], "nodes": inside}

    async def shut_out(self, need: str) -> None:
        """Take away all nodes that it has for a need."""
        for name in tuple(self._granted.pop(need, {})):
            await self._shut_out(name)

    def withdrawals(self) -> list[Callable[[], object]]:
        """What takes away all nodes of a worker that has ended; each may block, and raise
        `OSError`."""
        return [partial(self._withdraw, name) for name in tuple(self._reached)]

    async def _open_up(self, need: str, name: str, device: Mapping[str, Any], times: int) -> str:
        """Have one node where the worker can open it; where that is."""
        own = device["node"]
        self._reached.add(name)
        node = await asyncio.to_thread(self._reachable, name, own, times)
        if self._granted.setdefault(need, {}).get(name) != own:
            self._granted[need][name] = own
            try:
                await self._process.grant(name, node, own)
            except WorkerFailed as error:
                self._emit(WorkerLogged(self._component, "error", str(error)))
        return self._process.node(name, node)

    async def _shut_out(self, name: str) -> None:
        """Take one node away."""
        await self._process.revoke(name)
        self._reached.discard(name)
        await asyncio.to_thread(self._withdraw, name)

    def _reachable(self, name: str, own: str, times: int) -> str:
        """The node that it may open, for one of the machine's. Blocks."""
        node = reachable(self._component, name, own, self._process.user, times=times)
        self._lending.lend(name, node)
        return node

    def _withdraw(self, name: str) -> None:
        """Undo that. Blocks."""
        clear_away(
            partial(self._lending.take_back, name), partial(withdrawn, self._component, name)
        )


def is_there(device: Mapping[str, Any]) -> bool:
    """Whether all nodes of a device are there. Blocks."""
    return all(Path(node["node"]).exists() for node in device["nodes"])
