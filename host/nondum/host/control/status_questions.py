"""What people's tools may ask of a host at a glance, of its components and its store."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.confinement_level import ConfinementState
from nondum.host.control.arguments import Arguments
from nondum.host.control.machine import Machine
from nondum.host.control.news import News
from nondum.host.control.rows import (
    component_row,
    data_row,
    drive_row,
    gone_back,
    host_state,
    offered_row,
    payload_row,
)
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.row import Row
from nondum.host.mind.mind import Mind
from nondum.host.trust.vouched import Vouched
from nondum.host.workers.workers import Workers
from nondum.sdk.frozen import frozen

TOLD = 50
"""How many of the last sentences told to people are shown."""


@frozen
class StatusQuestions:
    """Each method is a verb; none changes anything."""

    catalogue: Catalogue
    mind: Mind
    workers: Workers
    confinement: ConfinementState
    """At which level workers are confined."""
    news: News
    stored: Callable[[], Awaitable[list[Row]]]
    """Lists the store: `wheel`, `bytes`, `used_by` (payload keys), `sha256`."""
    warnings: Callable[[], tuple[str, ...]]
    """What every status says of this host."""
    places: Callable[[], Mapping[str, str]]
    """Payload key → the peer that runs it, for those that run elsewhere."""
    vouched: Callable[[str], Vouched]
    """Payload key → who vouches for it."""
    shown: Callable[[], Row]
    """What people without a screen are shown."""
    trusted: Callable[[], Row | None]
    """The active trust file, in a few words; None: there is none."""
    machine: Callable[[], Machine]
    """Looks at the machine that this host runs on; blocks."""

    async def status(self, arguments: Arguments) -> Row:
        """The host, its payloads and its goals at a glance."""
        machine = await asyncio.to_thread(self.machine)
        snapshot, places = self.catalogue.snapshot(), self.places()
        return {
            "host": snapshot.host,
            "revision": snapshot.revision,
            "state": host_state(snapshot, places),
            "safe_mode": snapshot.safety.value,
            "warnings": [
                *self.warnings(),
                *map(_kept_out, self.mind.views.kept_out()),
                *(str(problem) for c in snapshot.components for problem in c.problems),
                *(f"{of}: {told}" for of, told in self.mind.views.troubles().items()),
                *map(_gone_back, gone_back(snapshot)),
            ],
            "trust": self.trusted(),
            "feedback": self.shown(),
            "machine": machine.to_dict(),
            "confinement": self.confinement.to_dict(),
            "payloads": [
                payload_row(
                    p,
                    self.news.progress(p.key),
                    places.get(p.key, ""),
                    snapshot.rollbacks,
                    self.vouched(p.key),
                    snapshot.components,
                )
                for p in snapshot.payloads
            ],
            "drives": [drive_row(d, self.news.ahead(d.id)) for d in snapshot.drives],
            "peers": [{"peer": p.name, "address": p.address} for p in snapshot.peers],
            "goals": self.mind.views.given(),
            "told": self.mind.views.told(self.mind.people.last_number - TOLD),
        }

    async def components(self, arguments: Arguments) -> list[Row]:
        """What the robot is made of."""
        pids, since = self.workers.pids(), self.workers.since_wall_s()
        asked = self.workers.asked()
        snapshot = self.catalogue.snapshot()
        payloads = {payload.key: payload for payload in snapshot.payloads}
        own = [
            component_row(
                c, snapshot.host, pids.get(c.id), payloads.get(c.payload), self.vouched(c.payload)
            )
            for c in snapshot.components
        ]
        troubles = self.mind.views.troubles()
        kept_out = {row["component"]: row["problem"] for row in self.mind.views.kept_out()}
        for row in own:
            told = [row["problem"], troubles.get(row["component"], "")]
            if why := kept_out.get(row["component"]):
                told.append(f"kept out of planning: {why}")
            told += map(str, self.workers.faults(row["component"]))
            row["problem"] = "; ".join(filter(None, told))
            row["since"] = since.get(row["component"])
            if limits := asked.get(row["component"]):
                row["granted"] = limits.given()
            row["confinement"] = str(self.workers.launcher.level) if row["pid"] else None
        return own + [
            offered_row(offered, peer.name)
            for peer in snapshot.peers
            for offered in peer.components
        ]

    async def data(self, arguments: Arguments) -> list[Row]:
        """The data that are here, and which components are shown them."""
        snapshot = self.catalogue.snapshot()
        return [data_row(data, snapshot.components) for data in snapshot.data]

    async def store(self, arguments: Arguments) -> list[Row]:
        """The wheels and files of data that are kept, and which payloads need them."""
        ids = {payload.key: payload.payload_id for payload in self.catalogue.snapshot().payloads}
        rows = await self.stored()
        return [{**row, "used_by": [ids.get(key, key) for key in row["used_by"]]} for row in rows]

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {
            "components": self.components,
            "data": self.data,
            "status": self.status,
            "store": self.store,
        }


def _gone_back(payload: PayloadRecord) -> str:
    return (
        f"{payload.payload_id} is at release {payload.release}: a person went back to it; "
        f"`nondum retry {payload.payload_id}` goes forward again"
    )


def _kept_out(row: Row) -> str:
    return f"{row['component']} is kept out of planning: {row['problem']}"
