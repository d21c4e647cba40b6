"""What people's tools may have a host do about payloads: install, retry, go back, forget."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments
from nondum.host.control.committed import until_committed
from nondum.host.control.news import News
from nondum.host.control.rows import gone_back, payload_row
from nondum.host.core.bus import Bus
from nondum.host.core.events.daemon import SafeModeLeft
from nondum.host.core.events.drives import DriveRetried
from nondum.host.core.events.payloads import ForgetAsked, RetryAsked
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.host.core.row import Row
from nondum.host.core.status import is_at_rest
from nondum.host.core.unknown import unknown
from nondum.host.lifecycle.retry_rules import is_quarantined
from nondum.host.manager import initial_components, rollback
from nondum.sdk.errors import InstallFailed, NondumError, Problem
from nondum.sdk.frozen import frozen


@frozen
class PayloadOrders:
    """Each method is a verb."""

    catalogue: Catalogue
    news: News
    bus: Bus

    async def retry(self, arguments: Arguments) -> Row:
        """Try again what was refused or quarantined: a payload, by id or component.

        Raises `InstallFailed` (RETRY_UNKNOWN, RETRY_NOTHING).
        """
        name = arguments.text("name")
        snapshot = self.catalogue.snapshot()
        found = [p for p in snapshot.payloads if name in (p.payload_id, p.key, *p.components)]
        if not found:
            known = {p.payload_id for p in snapshot.payloads}
            raise InstallFailed(unknown("payload", name, known))
        troubled = [payload for payload in found if _is_troubled(payload, snapshot)]
        if not troubled:
            raise InstallFailed(Problem("RETRY_NOTHING", "nothing is wrong with it", where=name))
        for payload in troubled:
            self.bus.emit(RetryAsked(payload.key))
        return {"payloads": [payload.payload_id for payload in troubled]}

    async def leave_safe_mode(self, arguments: Arguments) -> Row:
        """Take in what was left alone; with `all`, also each payload that was refused or
        quarantined, and each drive that daemons died at. Raises `NondumError` (SAFE_MODE_OFF)."""
        snapshot, brings_all = self.catalogue.snapshot(), arguments.flag("all")
        if snapshot.safety is Safety.OFF and not brings_all:
            fix = "`nondum host resume --all` brings back what is left alone all the same"
            raise NondumError(Problem("SAFE_MODE_OFF", "this host is not in safe mode", fix=fix))
        if snapshot.safety is not Safety.OFF:
            self.bus.emit(SafeModeLeft(snapshot.host))
            await until_committed(
                self.catalogue, self.news, lambda snapshot: snapshot.safety is Safety.OFF
            )
        row: Row = {"was": snapshot.safety.value}
        return row | {"payloads": self._retry_all()} if brings_all else row

    async def forget(self, arguments: Arguments) -> Row:
        """Forget a payload that was here. Raises `InstallFailed` (FORGET_UNKNOWN)."""
        payload_id = arguments.text("payload")
        known = [former.key for former in self.catalogue.snapshot().former]
        if payload_id not in known:
            message = f"nothing is remembered of a payload {payload_id!r} that was here"
            fix = f"remembered are: {', '.join(sorted(known)) or 'none'}"
            raise InstallFailed(Problem("FORGET_UNKNOWN", message, fix=fix))
        self.bus.emit(ForgetAsked(payload_id))
        await until_committed(
            self.catalogue,
            self.news,
            lambda snapshot: all(former.key != payload_id for former in snapshot.former),
        )
        return {"payload": payload_id}

    async def install(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Install a payload folder for good: how far it is, and at last that it is `done`.

        A client that leaves before has given it up: nothing of it stays. Raises `PayloadRefused`.
        """
        folder = Path(arguments.text("folder"))
        installing = initial_components.install(folder, self.catalogue, self.bus)
        async for row in self._told(asyncio.create_task(installing), folder.name):
            yield row

    async def rollback(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Go back to the release of a payload before: how far it is, and at last that it is `done`.

        Raises `InstallFailed` (ROLLBACK_NOTHING, …, or why the earlier release does not work).
        """
        going = rollback.go_back(arguments.text("payload"), self.catalogue, self.bus)
        async for row in self._told(asyncio.create_task(going), arguments.text("payload")):
            yield row

    async def uninstall(self, arguments: Arguments) -> Row:
        """Remove an installed payload. Raises `PayloadRefused` (NOT_INSTALLED)."""
        payload_id = arguments.text("payload")
        await initial_components.uninstall(payload_id, self.catalogue, self.bus)
        return {"payload": payload_id}

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {
            "forget": self.forget,
            "leave_safe_mode": self.leave_safe_mode,
            "retry": self.retry,
            "uninstall": self.uninstall,
        }

    def following(self) -> dict[str, Callable[[Arguments], AsyncIterator[Any]]]:
        """Verbs that go on answering."""
        return {"install": self.install, "rollback": self.rollback}

    def _retry_all(self) -> list[str]:
        """Try again all that is left alone; answers which."""
        snapshot = self.catalogue.snapshot()
        drives = [drive.id for drive in snapshot.drives if is_quarantined(drive.problems)]
        payloads = [payload for payload in snapshot.payloads if _is_troubled(payload, snapshot)]
        for id in drives:
            self.bus.emit(DriveRetried(id))
        for payload in payloads:
            self.bus.emit(RetryAsked(payload.key))
        return [*drives, *(payload.payload_id for payload in payloads)]

    async def _told(self, work: asyncio.Task[PayloadRecord], payload_id: str) -> AsyncIterator[Row]:
        """How far a payload is until work on it is done."""
        try:
            version = self.news.version
            while not work.done():
                yield {"done": False, "payload": self._payload(payload_id)}
                news = asyncio.create_task(self.news.changed(version))
                await asyncio.wait({news, work}, return_when=asyncio.FIRST_COMPLETED)
                news.cancel()
                version = self.news.version
            yield {"done": True, "payload": payload_row(work.result(), None)}
        finally:
            work.cancel()
            await asyncio.gather(work, return_exceptions=True)

    def _payload(self, payload_id: str) -> Row | None:
        """The row of a payload that is known already: of its release that is not at rest."""
        payloads = [p for p in self.catalogue.snapshot().payloads if p.payload_id == payload_id]
        found = min(payloads, key=lambda p: is_at_rest(p), default=None)
        return payload_row(found, self.news.progress(found.key)) if found else None


def _is_troubled(payload: PayloadRecord, snapshot: Snapshot) -> bool:
    if payload.step is not Step.ACTIVE:
        was_left = payload.step is Step.SUPERSEDED and any(
            other.payload_id == payload.payload_id for other in gone_back(snapshot)
        )
        return was_left or payload.step in (Step.REFUSED, Step.QUARANTINED)
    states = [c.state.value for c in snapshot.components if c.payload == payload.key]
    return "quarantined" in states
