"""What people's tools may ask of payloads on other hosts, and order."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments
from nondum.host.control.news import Progress
from nondum.host.core.events.event import Emit
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.row import Row
from nondum.host.core.unknown import unknown
from nondum.host.peers.placement.case import Case
from nondum.host.peers.placement.decide import ELSEWHERE, movable_source
from nondum.host.peers.placement.guest import Guest
from nondum.host.peers.placement.pins import Pins
from nondum.host.peers.placement.placing import Placing
from nondum.host.peers.placement.taking import Taking
from nondum.sdk.errors import NondumError, PayloadRefused, Problem
from nondum.sdk.frozen import frozen


@frozen
class PlaceOrders:
    """Each method is a verb."""

    catalogue: Catalogue
    placing: Placing
    taking: Taking
    pins: Pins
    emit: Emit
    known: Callable[[], Iterable[str]]
    """Names of other hosts that are here, or were."""

    async def places(self, arguments: Arguments) -> list[Row]:
        """Payloads that are to run on other hosts than the one that they are plugged into."""
        host = self.catalogue.state.host
        rows = [_row(case) for case in self.placing]
        rows += [_guest_row(guest, host) for guest in self.taking]
        placed = {row["payload"] for row in rows}
        absent = (pin for pin in sorted(self.pins.hosts.items()) if pin[0] not in placed)
        rows += [_absent_row(payload_id, pinned) for payload_id, pinned in absent]
        return sorted(rows, key=lambda row: (row["payload"], row["key"]))

    async def place(self, arguments: Arguments) -> Row:
        """Have a `payload` run on one `host` only, or, without one, wherever it fits, here first.

        Gives `payload`, `host`, and the host `before`. Raises `NondumError` (PAYLOAD_UNKNOWN,
        PEER_UNKNOWN), `PayloadRefused` (PLACE_FIXED, PLACE_OFF), `InstallFailed` (IO_ERROR).
        """
        payload_id, host = arguments.text("payload"), arguments.optional_text("host")
        before = self.pins.hosts.get(payload_id)
        here = [p for p in self.catalogue.state.payloads.values() if p.payload_id == payload_id]
        if host is None or host == self.catalogue.state.host:
            await self._unpin(payload_id, here)
        else:
            await self._pin(payload_id, here, host)
        self.placing.look()
        host = self.pins.hosts.get(payload_id)
        return {"payload": payload_id, "host": host, "before": before}

    async def _pin(self, payload_id: str, here: list[PayloadRecord], host: str) -> None:
        if not here:
            ids = {payload.payload_id for payload in self.catalogue.state.payloads.values()}
            raise NondumError(unknown("payload", payload_id, ids))
        if host not in (names := set(self.known())):
            raise NondumError(unknown("peer", host, names))
        if not self.placing.is_open:
            told, fix = "this host places nothing on others", "set `place = true` under [peers]"
            raise PayloadRefused(Problem("PLACE_OFF", told, where=payload_id, fix=fix))
        state = self.catalogue.state
        if all(movable_source(payload, state) is None for payload in here):
            told = "it was installed here for good, or another host has placed it here"
            fix = "plug a drive with it into this host, or place it from that one"
            raise PayloadRefused(Problem("PLACE_FIXED", told, where=payload_id, fix=fix))
        await self.pins.put(payload_id, host)

    async def _unpin(self, payload_id: str, here: list[PayloadRecord]) -> None:
        if payload_id not in self.pins.hosts:
            if not here:
                ids = {p.payload_id for p in self.catalogue.state.payloads.values()}
                raise NondumError(unknown("payload", payload_id, ids | self.pins.hosts.keys()))
            return
        await self.pins.drop(payload_id)
        for payload in here:
            if payload.step is Step.REFUSED and _codes(payload) == {ELSEWHERE}:
                self.emit(RetryAsked(payload.key))


def _codes(payload: PayloadRecord) -> set[str]:
    return {problem.code for problem in payload.problems}


def _row(case: Case) -> Row:
    """A payload of this host that is to run elsewhere."""
    parcel = case.parcel
    progress = Progress("fetch", case.done, case.total) if case.total else None
    return {
        "payload": parcel.payload_id,
        "key": parcel.key,
        "version": parcel.version,
        "state": case.step or "no host takes it",
        "host": case.host,
        "for": "",
        "pinned": parcel.pinned_to,
        "why": parcel.why,
        "progress": progress.to_dict() if progress and case.step == "fetching" else None,
        "declined": {
            host: [str(problem) for problem in declined.problems]
            for host, declined in case.declined.items()
        },
    }


def _guest_row(guest: Guest, host: str) -> Row:
    """A payload of a peer that runs here."""
    offer = guest.offer
    progress = Progress("fetch", guest.done, guest.total) if guest.step == "fetching" else None
    return {
        "payload": offer.payload_id,
        "key": guest.key,
        "version": guest.version,
        "state": guest.step,
        "host": host,
        "for": guest.incoming.caller.name,
        "pinned": "",
        "why": offer.why,
        "progress": progress.to_dict() if progress else None,
        "declined": {},
    }


def _absent_row(payload_id: str, pinned: str) -> Row:
    """A payload that is pinned, and not plugged in."""
    return {
        "payload": payload_id,
        "key": "",
        "version": "",
        "state": "not plugged in",
        "host": "",
        "for": "",
        "pinned": pinned,
        "why": "a person wants it there",
        "progress": None,
        "declined": {},
    }
