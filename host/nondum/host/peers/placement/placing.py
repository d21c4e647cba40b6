"""Payloads of this host that are to run elsewhere: each is handed to the first peer that takes it,
and to the next one when that is lost.

One call, `place.take`, is open for as long as the payload runs at the peer.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from nondum.host.core.events.daemon import HostStarted
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.placement import (
    PayloadPlaced,
    PayloadSentAway,
    PlaceLost,
    PlaceMissing,
)
from nondum.host.core.printable import printable
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.jobs.children import Children
from nondum.host.manager.state_folders import Folders
from nondum.host.peers.placement.case import AGAIN_S, STEPS, Case, Declined
from nondum.host.peers.placement.decide import (
    INSTALLING,
    Candidate,
    Compute,
    Parcel,
    parcels,
    ranked,
    sent_away,
)
from nondum.host.peers.placement.handover import Described, Handover
from nondum.host.peers.placement.pace import LARGEST
from nondum.host.peers.placement.pins import Pins
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.fleet.fleet import Fleet
from nondum.transport.peers import CallFailed, IncomingCall, PeerKey, PeerUnreachable

TAKE_S = 30 * 86400.0
"""Deadline of the call that lasts as long as the payload is there; then it is made again."""
_ENDED = frozenset({"DEADLINE", "HALTED"})
"""How calls end that nothing is wrong with."""


class Placing:
    """Finds places. `await close()` it."""

    def __init__(
        self,
        fleet: Callable[[], Fleet],
        state: Callable[[], HostState],
        folders: Folders,
        children: Children,
        emit: Emit,
        pins: Pins,
        *,
        here: Compute,
        reserve_mb: int,
        is_open: bool,
    ) -> None:
        """`here` is what this host has to compute with. `is_open`: whether anything is placed."""
        self._fleet, self._state, self._folders = fleet, state, folders
        self._children, self._emit, self._pins = children, emit, pins
        self._here, self._reserve_mb, self.is_open = here, reserve_mb, is_open
        self._cases: dict[str, Case] = {}
        self._news = asyncio.Event()
        self._is_started = False
        self._numbers = itertools.count(1)

    def __iter__(self) -> Iterator[Case]:
        """All that is to run elsewhere."""
        return iter(tuple(self._cases.values()))

    def on_event(self, event: Event) -> None:
        """Take in what happens here, peers included."""
        self._is_started |= isinstance(event, HostStarted)
        if event.JOURNALLED and self._is_started:
            self.look()

    def look(self) -> None:
        """Compare what is to run elsewhere with what is being done about it."""
        wanted = parcels(self._state(), self._pins.hosts) if self.is_open else {}
        for key, case in tuple(self._cases.items()):
            parcel = wanted.get(key)
            if parcel is None or parcel.pinned_to != case.parcel.pinned_to:
                self._drop(case)
            else:
                case.parcel = parcel
        for key, parcel in wanted.items():
            if key not in self._cases:
                self._begin(parcel)
            if parcel.pinned_to and parcel.step in INSTALLING:
                self._send_away(parcel, parcel.pinned_to)
        self._tell()

    # What peers ask of it

    async def want(self, incoming: IncomingCall) -> Body:
        """Have files ready for the peer that takes a payload. Raises `CallFailed` (NOT_OFFERED)
        and what reading the drive does."""
        match incoming.args:
            case {"digest": str(digest), "wanted": list(wanted)} if all(
                isinstance(sha256, str) for sha256 in wanted
            ):
                await self._handover_to(incoming, digest).want(wanted)
                return {}
        raise CallFailed(_malformed("digest and wanted"))

    async def read(self, incoming: IncomingCall) -> Body:
        """A piece of a file: `data`. Raises `CallFailed` (NOT_OFFERED)."""
        match incoming.args:
            case {
                "digest": str(digest),
                "sha256": str(sha256),
                "offset": int(offset),
                "length": int(length),
            } if 0 <= offset < 2**53 and 0 < length <= LARGEST:
                handover = self._handover_to(incoming, digest)
                return {"data": await handover.read(sha256, offset, length)}
        raise CallFailed(_malformed("digest, sha256, offset and length"))

    async def close(self) -> None:
        """Give up everything."""
        tasks = [case.task for case in self if case.task is not None]
        self._cases.clear()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _handover_to(self, incoming: IncomingCall, digest: str) -> Handover:
        for case in self:
            candidate, handover = case.candidate, case.handover
            is_it = case.parcel.digest == digest and handover is not None
            if is_it and candidate is not None and candidate.key == incoming.caller.key:
                assert handover is not None
                return handover
        told = "no such payload is handed over to this host"
        raise CallFailed(Problem("NOT_OFFERED", told))

    # One payload

    def _begin(self, parcel: Parcel) -> None:
        case = self._cases[parcel.key] = Case(parcel)
        case.task = asyncio.create_task(self._see_to(case))

    def _drop(self, case: Case) -> None:
        del self._cases[case.parcel.key]
        if case.task is not None:
            case.task.cancel()

    async def _see_to(self, case: Case) -> None:
        """Ask one peer after the other, for as long as the payload is to run elsewhere."""
        while True:
            candidate = self._next(case)
            if candidate is None:
                self._tell_missing(case)
                await self._changed()
            else:
                await self._place(case, candidate)

    def _next(self, case: Case) -> Candidate | None:
        """The best peer that has not said no; None also while the drive cannot be read."""
        now_s = asyncio.get_running_loop().time()

        def has_declined(host: str, epoch: int) -> bool:
            declined = case.declined.get(host)
            return declined is not None and declined.holds(epoch, now_s)

        if has_declined(self._state().host, self._fleet().epoch):
            return None
        candidates = ranked(self._candidates(), case.parcel, self._here)
        return next((c for c in candidates if not has_declined(c.host, c.epoch)), None)

    def _candidates(self) -> Iterator[Candidate]:
        for key, peer in self._fleet().peers.items():
            yield Candidate(PeerKey(key), peer.name, peer.epoch, peer.entries.get("compute", {}))

    async def _place(self, case: Case, candidate: Candidate) -> None:
        """Have a peer run it, until that ends."""
        handover = case.handover = self._handover(case.parcel)
        case.candidate, case.step, case.done, case.total = candidate, STEPS[0], 0, 0
        try:
            described = await self._opened(case, handover)
            if described is not None:
                await self._run(case, candidate, described)
        finally:
            case.candidate, case.handover, case.step = None, None, ""
            await handover.close()

    async def _opened(self, case: Case, handover: Handover) -> Described | None:
        """What is told of it first; None if the drive cannot be read."""
        try:
            return await handover.open()
        except NondumError as error:
            self._decline(case, self._state().host, self._fleet().epoch, error.problems)
            return None

    def _handover(self, parcel: Parcel) -> Handover:
        name = f"{parcel.key}-{next(self._numbers)}"
        return Handover(name, parcel, self._folders, self._children, reserve_mb=self._reserve_mb)

    async def _run(self, case: Case, candidate: Candidate, described: Described) -> None:
        args = {
            "digest": case.parcel.digest,
            "payload": case.parcel.payload_id,
            "contents": described.contents,
            "signature": described.signature,
            "why": case.parcel.why,
        }
        problems: tuple[Problem, ...] = ()
        try:
            await self._call(case, candidate, args)
        except PeerUnreachable as error:
            problems = error.problems
            if candidate.key in self._fleet().peers:  # it takes no more calls now
                self._decline(case, candidate.host, candidate.epoch, problems)
        except NondumError as error:
            problems = error.problems
            is_final = case.step in ("installing", "active") and error.code not in _ENDED
            self._decline(case, candidate.host, candidate.epoch, problems, is_final=is_final)
        if case.step == "active":
            reason = "; ".join(printable(str(problem)) for problem in problems)
            self._emit(PlaceLost(case.parcel.key, candidate.host, reason))

    async def _call(self, case: Case, candidate: Candidate, args: Body) -> None:
        call = self._fleet().call(candidate.key, "place.take", args, deadline_s=TAKE_S)
        try:
            async for news in call:
                await self._on_news(case, news)
            await call
        finally:
            call.cancel()
        told = "it ended there without a word"
        raise CallFailed(Problem("PLACE_ENDED", told, where=candidate.host))

    def _decline(
        self,
        case: Case,
        host: str,
        epoch: int,
        problems: tuple[Problem, ...],
        *,
        is_final: bool = False,
    ) -> None:
        now_s = asyncio.get_running_loop().time()
        case.declined[host] = Declined(epoch, problems, now_s, is_final)

    async def _on_news(self, case: Case, news: Mapping[str, Any]) -> None:
        before = case.step
        match news:
            case {"step": str(step), "done": int(done), "total": int(total)} if step in STEPS:
                case.step, case.done, case.total = step, done, total
        if case.step == "active" != before:
            if case.handover is not None:
                await case.handover.drop_wheels()
            parcel = case.parcel
            if parcel.step is not Step.REFUSED:
                self._send_away(parcel, case.host)
            self._emit(PayloadPlaced(parcel.key, case.host, parcel.why))

    def _send_away(self, parcel: Parcel, host: str) -> None:
        self._emit(PayloadSentAway(parcel.key, host, (sent_away(parcel, host),)))

    def _tell_missing(self, case: Case) -> None:
        """Say once that no peer takes it, and why."""
        problems = tuple(
            replace(problem, where=host)
            for host, declined in sorted(case.declined.items())
            for problem in declined.problems
        )
        if problems and problems != case.told:
            case.told = problems
            self._emit(PlaceMissing(case.parcel.key, problems))

    async def _changed(self) -> None:
        """Wait until somebody may take it who did not before."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(AGAIN_S):
                await self._news.wait()

    def _tell(self) -> None:
        self._news.set()
        self._news = asyncio.Event()


def _malformed(need: str) -> Problem:
    return Problem("CALL_MALFORMED", "a call's arguments are not what it takes", need=need)
