"""All that this host has to do with payloads on other hosts than the one that they were plugged
into, made and tied together."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.host_config import HostConfig
from nondum.host.control.arguments import Arguments
from nondum.host.core.events.event import Emit, Event
from nondum.host.jobs.children import Children
from nondum.host.manager.state_folders import Folders
from nondum.host.peers.dispatch import Dispatcher
from nondum.host.peers.placement.decide import Compute
from nondum.host.peers.placement.orders import PlaceOrders
from nondum.host.peers.placement.pins import Pins
from nondum.host.peers.placement.placing import Placing
from nondum.host.peers.placement.taking import Taking
from nondum.transport.fleet.fleet import Fleet
from nondum.wheelhouse.format.confinement import Level


class Placement:
    """`await open(…)` it, and `await close()` it before the fleet."""

    def __init__(
        self,
        config: HostConfig,
        folders: Folders,
        children: Children,
        catalogue: Catalogue,
        emit: Emit,
        fleet: Callable[[], Fleet],
        *,
        pins: Pins,
        compute: Compute,
        confinement: Level,
        judged_by: Callable[[str], Awaitable[Mapping[str, Any]]],
        known: Callable[[], Iterable[str]],
    ) -> None:
        """`confinement` is the level at which workers run; `judged_by` what payloads are judged
        by now, for child processes; `known` are names of other hosts."""
        reserve_mb, is_open = config.install.reserve_mb, config.peers.place

        def state() -> Any:
            return catalogue.state

        self.placing = Placing(
            fleet,
            state,
            folders,
            children,
            emit,
            pins,
            here=compute,
            reserve_mb=reserve_mb,
            is_open=is_open,
        )
        self.taking = Taking(
            fleet,
            state,
            folders,
            children,
            emit,
            rules={
                "store": str(folders.store),
                "reserve_mb": reserve_mb,
                "confinement": str(confinement),
                "method": config.install.method,
            },
            judged_by=judged_by,
            is_open=is_open,
        )
        self._orders = PlaceOrders(catalogue, self.placing, self.taking, pins, emit, known)

    def serve(self, requests: Dispatcher) -> None:
        """Have peers' calls carried out."""
        requests.add("place.take", self.taking.take)
        requests.add("place.want", self.placing.want)
        requests.add("place.read", self.placing.read)

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {"place": self._orders.place, "places": self._orders.places}

    def places(self) -> dict[str, str]:
        """Payload key → the peer that runs it, or gets it."""
        return {case.parcel.key: case.host for case in self.placing if case.step == "active"}

    def on_event(self, event: Event) -> None:
        """Take in what happens on this host."""
        self.placing.on_event(event)
        self.taking.on_event(event)

    async def close(self) -> None:
        """Give up what is placed; it is withdrawn at the peers."""
        await self.placing.close()
