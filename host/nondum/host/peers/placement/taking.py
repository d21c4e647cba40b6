"""Payloads that peers hand over to this host: judged here, fetched, and inserted like a drive.

A call lasts as long as its payload is here: whatever ends it, its caller's loss included, pulls the
drive that stands for it.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Awaitable, Callable, Iterator, Mapping
from functools import partial
from typing import Any, NoReturn

from nondum.host.core.clock import now
from nondum.host.core.events.daemon import HostStarted
from nondum.host.core.events.drives import DriveInserted, DriveRemoved
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.payloads import PayloadFound
from nondum.host.core.events.placement import PayloadTaken
from nondum.host.core.keyed_queues import in_thread
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.jobs.children import Children
from nondum.host.lifecycle import admission
from nondum.host.manager.state_folders import Folders, remove
from nondum.host.peers.placement.decide import PLACED
from nondum.host.peers.placement.fetching import Fetching, Listed
from nondum.host.peers.placement.guest import Guest, Offer
from nondum.sdk.errors import InstallFailed, PayloadRefused, Problem
from nondum.sdk.wire import Body
from nondum.transport.fleet.fleet import Fleet
from nondum.transport.peers import Call, CallFailed, IncomingCall, PeerKey
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.format.signatures import Grant

AT_ONCE = 2
"""Payloads that are fetched from one peer at the same time; others wait."""
MOST = 64
"""Payloads of others that are taken."""
READ_S = 20.0
"""What a peer has to answer with a piece of a file."""
COPY_S = 3600.0
"""What a peer has to copy files from a drive."""
SIGN_S = 1.0
"""Time between two reports: one may be lost on the way."""


class Taking:
    """Takes what fits this host and its rules."""

    def __init__(
        self,
        fleet: Callable[[], Fleet],
        state: Callable[[], HostState],
        folders: Folders,
        children: Children,
        emit: Emit,
        *,
        rules: Mapping[str, Any],
        judged_by: Callable[[str], Awaitable[Mapping[str, Any]]],
        is_open: bool,
    ) -> None:
        """`rules` are what the children go by: where the store is, what is left free; `judged_by`,
        whose payloads are let in now, and what memory there is for one beside a release of it:
        peers bring nothing in that drives may not. `is_open`: whether any payload of others is
        taken."""
        self._fleet, self._state, self._folders = fleet, state, folders
        self._children, self._emit = children, emit
        self._rules, self._judged_by, self._is_open = rules, judged_by, is_open
        self._turns: dict[PeerKey, asyncio.Semaphore] = {}
        """By peer: one that stalls does not keep other peers waiting."""
        self._numbers = itertools.count(1)
        self._guests: dict[str, Guest] = {}
        self._started = asyncio.Event()

    def __iter__(self) -> Iterator[Guest]:
        """All that is here, or on its way here, from peers."""
        return iter(tuple(self._guests.values()))

    def on_event(self, event: Event) -> None:
        """Take in what happens here."""
        if isinstance(event, HostStarted):
            self._started.set()
        if event.JOURNALLED:
            for guest in self:
                guest.news.set()

    async def take(self, incoming: IncomingCall) -> Body:
        """Run a peer's payload here until the peer ends the call. Progress has `step`, `done` and
        `total`. Raises `CallFailed` and `PayloadRefused` with what keeps it from running here."""
        offer = Offer.parse(incoming.args)
        self._check_open()
        guest = self._guest(offer, incoming)
        self._guests[guest.drive] = guest
        is_inserted = False
        try:
            await self._started.wait()
            async with self._turns.setdefault(incoming.caller.key, asyncio.Semaphore(AT_ONCE)):
                await self._fetch(guest)
            is_inserted = True
            self._emit(DriveInserted(guest.drive, guest.root, PLACED))
            await self._follow(guest)
        finally:
            del self._guests[guest.drive]
            if is_inserted:
                self._emit(DriveRemoved(guest.drive))
            await in_thread(remove, guest.root)

    def _check_open(self) -> None:
        if not self._is_open:
            told, fix = "this host takes no payloads of others", "set `place = true` under [peers]"
            raise CallFailed(Problem("PLACE_CLOSED", told, fix=fix))
        if len(self._guests) >= MOST:
            told = f"this host has {MOST} payloads of others already"
            raise CallFailed(Problem("PLACE_FULL", told))

    def _guest(self, offer: Offer, incoming: IncomingCall) -> Guest:
        number = next(self._numbers)
        drive = f"{PLACED}/{incoming.caller.name}/{number}"
        root = self._folders.placed / str(number)
        return Guest(offer, incoming, drive, root, self._state().key_of(offer.digest))

    # Fetching

    async def _fetch(self, guest: Guest) -> None:
        """Have here what this host needs of a payload. Raises all that it is refused for."""
        fetching = Fetching(guest.folder, partial(self._read, guest))
        guest.tell("checking")
        try:
            await self._fetch_contents(guest, fetching)
            for row in await self._run(guest, "outline", {}):
                await fetching.fetch(Listed(*row))
            judged = await self._run(guest, "judge", await self._judged(guest))
            await self._fetch_wheels(guest, fetching, [Listed(*row) for row in judged["needed"]])
        except OSError as error:
            told = f"what is fetched cannot be written: {error.strerror}"
            raise InstallFailed(Problem("IO_ERROR", told, where=guest.offer.payload_id)) from error

    async def _judged(self, guest: Guest) -> dict[str, Any]:
        """What children judge a payload by: the active release of it is stopped, and its memory
        freed, for the new one."""
        active = (p for p in self._state().payloads.values() if p.step is Step.ACTIVE)
        same = (p.key for p in active if p.payload_id == guest.offer.payload_id)
        beside = next(same, "")
        return {**self._rules, **await self._judged_by(beside)}

    async def _run(self, guest: Guest, job: str, arguments: Mapping[str, Any]) -> Any:
        """Have a child that reads nothing but this guest do a job with its folder."""
        given = {**arguments, "folder": str(guest.folder)}
        return await self._children.run(job, given, owner=guest.drive)

    async def _fetch_contents(self, guest: Guest, fetching: Fetching) -> None:
        """The contents list, and whether this host's own rules let it in."""
        offer = guest.offer
        await fetching.fetch(Listed(contents.NAME, offer.digest, offer.contents))
        if offer.signature is not None:
            signature = guest.folder / contents.SIGNATURE_NAME
            await in_thread(signature.write_bytes, offer.signature)
        arguments = {"kind": PLACED, "root": str(guest.root), "node": None}
        arguments |= await self._judged(guest)
        (said,) = (await self._run(guest, "look", arguments))["payloads"]
        found = PayloadFound(
            said["payload"],
            guest.drive,
            guest.folder,
            said["digest"],
            said["payload_id"],
            said["version"],
            said["release"],
            said["fleet"],
            signers=tuple(said["signers"]),
            grant=Grant.parse(said["grant"]),
            built=said["built"],
        )
        problems = [Problem(**problem) for problem in said["problems"]]
        problems += admission.release_problems(self._state(), found, now())
        if found.payload_id != offer.payload_id:
            told = f"the contents list is {found.payload_id}'s"
            problems.append(Problem("CALL_MALFORMED", told, need=offer.payload_id))
        if problems:
            raise PayloadRefused(*problems)
        guest.version = found.version

    async def _fetch_wheels(self, guest: Guest, fetching: Fetching, needed: list[Listed]) -> None:
        if not needed:
            return
        guest.total = sum(listed.size for listed in needed)
        guest.tell("fetching")
        wanted = {"digest": guest.offer.digest, "wanted": [listed.sha256 for listed in needed]}
        await self._call(guest, "place.want", wanted, COPY_S)
        fetching.on_bytes = guest.add
        for listed in needed:
            await fetching.fetch(listed)

    def _read(self, guest: Guest, sha256: str, offset: int, length: int) -> Call:
        place = {"sha256": sha256, "offset": offset, "length": length}
        args = {"digest": guest.offer.digest, **place}
        return self._call(guest, "place.read", args, READ_S)

    def _call(self, guest: Guest, method: str, args: Body, deadline_s: float) -> Call:
        return self._fleet().call(guest.incoming.caller.key, method, args, deadline_s=deadline_s)

    # Once it is here

    async def _follow(self, guest: Guest) -> NoReturn:
        """Report how it is, until it is no more. Raises `PayloadRefused` with why it is not."""
        was_read = False
        while True:
            guest.news.clear()
            state = self._state()
            drive, payload = state.drives.get(guest.drive), state.payloads.get(guest.key)
            if drive is not None and drive.problems:
                raise PayloadRefused(*drive.problems)
            if payload is not None and guest.drive in payload.sources:
                await self._look_at(guest, payload)
            elif was_read and (drive is None or drive.state is not DriveState.READING):
                told = "it was withdrawn there"
                raise PayloadRefused(Problem("PLACE_ENDED", told, where=guest.offer.payload_id))
            was_read |= drive is not None and drive.state is not DriveState.READING
            await _either(guest.news, SIGN_S)

    async def _look_at(self, guest: Guest, payload: PayloadRecord) -> None:
        """Report how it is. Raises `PayloadRefused` with why it does not run."""
        if payload.step in (Step.REFUSED, Step.QUARANTINED):
            raise PayloadRefused(*payload.problems)
        if payload.step is Step.ACTIVE and guest.step != "active":
            await in_thread(remove, guest.folder / "wheels")  # the store has them now
            self._emit(PayloadTaken(guest.key, guest.incoming.caller.name, guest.offer.why))
        guest.tell("active" if payload.step is Step.ACTIVE else "installing")


async def _either(news: asyncio.Event, most_s: float) -> None:
    """Wait for news, but not for ever."""
    try:
        async with asyncio.timeout(most_s):
            await news.wait()
    except TimeoutError:
        return
