"""Finds other hosts: by multicast, and by asking those that the integrator has given."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from nondum.sdk.errors import Problem
from nondum.transport.discovery import interfaces as network
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.discovery.hint import Hint, Source, host_of
from nondum.transport.discovery.hint_table import Change, HintTable
from nondum.transport.discovery.interfaces import Interface
from nondum.transport.discovery.reach import worth_trying
from nondum.transport.discovery.responder import Responder
from nondum.transport.discovery.static_host import StaticHost
from nondum.transport.discovery.status import DiscoveryStatus, InterfaceRow
from nondum.transport.discovery.unicast_queries import Asker
from nondum.transport.discovery.watch import InterfaceWatch
from nondum.transport.peers.keys import PeerKey

if TYPE_CHECKING:
    from nondum.transport.discovery.multicast import Multicast

log = logging.getLogger(__name__)

AGAIN_S = 5.0
"""Time between two announcements of this host; more where there are many hosts."""
RARELY_S = 15.0
MANY = 50
SILENT_S = 60.0
"""A host that was not announced for so long is not hinted at any more."""
RETRY_S = 3.0
"""Time until what did not work is tried again, if nothing changes before."""


class Discovery:
    """Looks for hosts from `await start()` to `await close()`."""

    def __init__(
        self,
        announcement: Announcement,
        *,
        on_hint: Callable[[Hint], None],
        on_gone: Callable[[PeerKey], None],
        static: Sequence[str] = (),
        multicast: bool = True,
        prefers: Callable[[PeerKey], bool] = lambda _: False,
    ) -> None:
        """Made on the running loop. Raises `ConfigRefused` (STATIC_HOST).

        `on_hint` is told of a host that is new or of which something is new, `on_gone` of one that
        nothing hints at any more. Both are hearsay: nothing but dialling may come of them, and no
        link that works may be cut. `prefers` names peers that no flood of others may push out.
        """
        self._announcement = announcement
        self._on_hint, self._on_gone = on_hint, on_gone
        self._wants_multicast = multicast
        self._loop = asyncio.get_running_loop()
        self._table = HintTable(announcement.key, announcement.epoch, prefers, self._loop.time())
        self._responder = Responder(announcement)
        self._asker = Asker(
            [StaticHost.parse(host) for host in static],
            announcement.security,
            on_hint=self._take_hint,
            on_gone=lambda key: self._tell(self._table.remove(key, Source.STATIC)),
            on_refused=self._refused,
        )
        self._multicast: Multicast | None = None
        self._watch = InterfaceWatch(lambda: self._dirty.set())
        self._dirty = asyncio.Event()
        self._interfaces: tuple[Interface, ...] = ()
        self._keeping: asyncio.Task[None] | None = None
        self._again: asyncio.TimerHandle | None = None

    @property
    def hints(self) -> Mapping[PeerKey, Hint]:
        """The current hints: 512 peers at most, with 16 addresses each."""
        return self._table.hints

    async def start(self) -> None:
        """Begin to look and to be found. A network may come later: what does not work yet is told
        by `status`, and tried again. Raises `OSError` when there are no sockets at all."""
        if self._wants_multicast:
            self._multicast = self._new_multicast()
        self._watch.start()
        await self._responder.start()
        await self._asker.start()
        await self._follow()
        self._keeping = self._loop.create_task(self._keep_following())
        self._again = self._loop.call_later(self._again_s(), self._say_again)

    def announce(self, announcement: Announcement) -> None:
        """Announce something else of this host from now on; its key and epoch stay."""
        self._announcement = self._responder.announcement = announcement
        self._dirty.set()

    def look_again(self) -> None:
        """Ask static hosts again now: something about them may have changed."""
        self._asker.hurry()

    def status(self) -> DiscoveryStatus:
        """What was done and met."""
        responder, multicast = self._responder.problem, self._multicast
        problems = [self._table.problem(), responder, multicast.problem if multicast else None]
        every = network.read()
        used = {one.name for one in self._looked_on(every)}
        return DiscoveryStatus(
            interfaces=tuple(self._row(one, is_used=one.name in used) for one in every),
            static=self._asker.rows,
            hints=len(self._table.hints),
            refused=dict(self._table.refused),
            problems=tuple(one for one in problems if one is not None),
        )

    @property
    def identity_problem(self) -> Problem | None:
        """What a person must know of another host under this one's key or name."""
        return self._table.problem()

    async def close(self) -> None:
        """Say goodbye, and let go of everything."""
        if self._again is not None:
            self._again.cancel()
        if self._keeping is not None:
            self._keeping.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._keeping
        self._watch.close()
        self._responder.close()
        await self._asker.close()
        if self._multicast is not None:
            await self._multicast.close()

    def _new_multicast(self) -> Multicast:
        # Imported where it is wanted: it takes 4 MB.
        from nondum.transport.discovery.multicast import Multicast

        return Multicast(
            self._announcement.security,
            on_hint=self._take_hint,
            on_gone=lambda key: self._tell(self._table.remove(key, Source.MULTICAST)),
            on_refused=self._refused,
        )

    async def _keep_following(self) -> None:
        while True:
            wait_s = RETRY_S if self._is_hindered() else None
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(wait_s):
                    await self._dirty.wait()
            self._dirty.clear()
            try:
                await self._follow()
            except OSError as error:  # no descriptors, no memory: such things pass
                log.warning("the network cannot be followed: %s", error)
                self._dirty.set()
                await asyncio.sleep(RETRY_S)

    async def _follow(self) -> None:
        """Be on the interfaces that there are, with what is to be announced."""
        found = self._looked_on(network.read())
        is_new, self._interfaces = found != self._interfaces, found
        await self._responder.start()
        if self._multicast is not None:
            await self._multicast.reconcile(self._announcement, found)
            if is_new:
                self._multicast.appear()
        if is_new:
            self._asker.hurry()

    def _looked_on(self, every: Sequence[Interface]) -> tuple[Interface, ...]:
        if self._announcement.is_on_this_machine_only:
            return network.loopback(every)
        return network.looked_on(every)

    def _is_hindered(self) -> bool:
        multicast = self._multicast
        if multicast is not None and (multicast.problem or multicast.unused):
            return True
        return self._responder.problem is not None

    def _again_s(self) -> float:
        """When to say again that this host is there: together, hosts are never much to hear."""
        often_s = AGAIN_S * (1 + len(self._table.received) / MANY)
        return min(often_s, RARELY_S) * random.uniform(0.8, 1.2)

    def _say_again(self) -> None:
        self._again = self._loop.call_later(self._again_s(), self._say_again)
        if self._multicast is not None:
            self._multicast.announce()
        for one in self._table.received:
            is_silent = self._loop.time() - one.at_s > SILENT_S
            if one.hint.source is Source.MULTICAST and is_silent:
                self._tell(self._table.remove(one.hint.key, Source.MULTICAST))

    def _take_hint(self, hint: Hint) -> None:
        addresses = hint.addresses
        if hint.source is Source.MULTICAST:
            addresses = worth_trying(addresses, self._interfaces)
            if not addresses:
                return self._refused(_NOWHERE)
        interface = network.of_host(host_of(addresses[0]), self._interfaces)
        found = replace(hint, addresses=addresses, interface=interface)
        is_new = not self._table.knows(hint.key)
        change = self._table.add(found, self._loop.time())
        if is_new and change.told is not None and self._multicast is not None:
            self._multicast.greet()
        return self._tell(change)

    def _refused(self, problem: Problem) -> None:
        self._table.refused[problem.code] += 1

    def _tell(self, change: Change) -> None:
        if change.gone is not None:
            self._on_gone(change.gone)
        if change.told is not None:
            self._on_hint(change.told)

    def _row(self, interface: Interface, *, is_used: bool) -> InterfaceRow:
        heard = [one for one in self._table.received if one.hint.interface == interface.name]
        multicast = self._multicast
        return InterfaceRow(
            interface=interface.name,
            addresses=interface.hosts,
            is_looked_on=is_used,
            announced_s=multicast.announced_s.get(interface.name) if multicast else None,
            heard=len(heard),
            heard_s=max((one.at_s for one in heard), default=None),
            problem=multicast.unused.get(interface.name) if multicast else None,
        )


_NOWHERE = Problem("HINT_NOWHERE", "none of the addresses named can be another host's near here")
