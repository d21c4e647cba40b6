"""Announces this host by DNS-SD over multicast, and hears others. Source: RFC 6762, RFC 6763.

zeroconf does the work. What it does not do by itself: follow the interfaces, and say again and
again that this host is there, so that hosts whose networks meet later find each other too.
"""

from __future__ import annotations

import asyncio
import logging
import random
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from ipaddress import ip_address
from typing import Any

from zeroconf import (  # type: ignore[attr-defined] # zeroconf keeps the DNS… for its callers
    DNSOutgoing,
    DNSQuestion,
    Error,
    IPVersion,
)
from zeroconf.asyncio import AsyncServiceInfo, AsyncZeroconf

from nondum.sdk.errors import Problem
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.discovery.hint import MAX_ADDRESSES, SERVICE, Hint, instance, to_txt
from nondum.transport.discovery.interfaces import Flags, Interface, has_ipv6, memberships
from nondum.transport.discovery.mdns_listener import MdnsListener
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import PeerKey, fingerprint

APPEAR_S = (0.0, 1.0, 2.5)
"""When a host is announced after a change: the first packets over a new link may get lost."""
GREET_S = 0.25
"""Least time between two greetings of new hosts: a hundred hosts may boot at once."""
GREET_JITTER_S = 0.02
_QUERY, _POINTER, _INTERNET = 0, 12, 1  # RFC 1035: flags, type PTR, class IN


class Multicast:
    """Multicast DNS of this host, from the first `reconcile` to `close`."""

    def __init__(
        self,
        security: Security,
        *,
        on_hint: Callable[[Hint], None],
        on_gone: Callable[[PeerKey], None],
        on_refused: Callable[[Problem], None],
    ) -> None:
        """Only hosts that are secured alike are told of."""
        self._listener = MdnsListener(security, on_hint, on_gone, on_refused)
        self._loop = asyncio.get_running_loop()
        self._zeroconf: AsyncZeroconf | None = None
        self._info: AsyncServiceInfo | None = None
        self._choice: list[str | int] = []
        self._tasks: set[asyncio.Task[Any]] = set()
        self._timers: list[asyncio.TimerHandle] = []
        self._greeting: asyncio.TimerHandle | None = None
        self._greeted_s = -GREET_S
        self._used_interfaces: list[str] = []
        self.problem: Problem | None = None
        """Why it does not work at all."""
        self.unused: dict[str, Problem] = {}
        """The interfaces that it does not work on, and why."""
        self.announced_s: dict[str, float] = {}
        """When this host was last announced, by interface."""
        # What zeroconf warns of is told here, with what to do about it.
        logging.getLogger("zeroconf").setLevel(logging.ERROR)

    async def reconcile(self, announcement: Announcement, interfaces: Sequence[Interface]) -> None:
        """Be on these interfaces, and no others, with this announcement. What fails is told by
        `problem` and `unused`; then it is to be tried again."""
        choice = _choice(interfaces)
        info = _info(announcement, interfaces)
        try:
            await self._join(choice, info)
        except (OSError, RuntimeError, Error) as error:
            self.problem = _unusable(error)
        else:
            self.problem = None
            self.unused = self._find_unused(interfaces)
        self._used_interfaces = [one.name for one in interfaces if one.name not in self.unused]

    def announce(self) -> None:
        """Say once more that this host is there."""
        if self._zeroconf is not None and self._info is not None:
            zeroconf = self._zeroconf.zeroconf
            zeroconf.async_send(zeroconf.generate_service_broadcast(self._info, None))
            self.announced_s = dict.fromkeys(self._used_interfaces, self._loop.time())

    def appear(self) -> None:
        """Say that this host is there and ask who else is, now and a few times soon."""
        for timer in self._timers:
            timer.cancel()
        self._timers = [self._loop.call_later(delay_s, self._appear) for delay_s in APPEAR_S]

    def greet(self) -> None:
        """Announce this host soon, for a new host: it need not wait for the next announcement."""
        if self._greeting is None:
            since_s = self._loop.time() - self._greeted_s
            wait_s = max(GREET_S - since_s, random.uniform(0, GREET_JITTER_S))
            self._greeting = self._loop.call_later(wait_s, self._greet)

    async def close(self) -> None:
        """Say goodbye, and let go of everything."""
        for timer in (*self._timers, self._greeting):
            if timer is not None:
                timer.cancel()
        for task in self._tasks:
            task.cancel()
        if self._zeroconf is not None:
            await self._zeroconf.async_unregister_all_services()
            await self._zeroconf.async_close()

    async def _join(self, choice: list[str | int], info: AsyncServiceInfo) -> None:
        if self._zeroconf is None:
            self._zeroconf = await self._open(choice)
            self._choice = choice
        if self._info is None:
            # Names are unique by construction: no need for a second of probing (RFC 6762, 8.1).
            told = self._zeroconf.async_register_service(info, cooperating_responders=True)
            self._keep(await told)
        elif _records(info) != _records(self._info):
            self._keep(await self._zeroconf.async_update_service(info))
        self._info = info
        if choice != self._choice or self.unused:
            self._choice = choice
            await self._zeroconf.async_update_interfaces(interfaces=choice)

    async def _open(self, choice: list[str | int]) -> AsyncZeroconf:
        version = IPVersion.All if has_ipv6() else IPVersion.V4Only
        opened = AsyncZeroconf(interfaces=choice, ip_version=version)
        # At once: zeroconf drops the repetition of an earlier packet as a duplicate.
        opened.zeroconf.async_add_listener(self._listener, None)
        try:
            await opened.zeroconf.async_wait_for_start()
        except BaseException:
            await opened.async_close()
            raise
        return opened

    def _keep(self, task: Awaitable[Any]) -> None:
        future = asyncio.ensure_future(task)
        self._tasks.add(future)
        future.add_done_callback(self._tasks.discard)

    def _greet(self) -> None:
        self._greeting = None
        self._greeted_s = self._loop.time()
        self.announce()

    def _appear(self) -> None:
        self.announce()
        if self._zeroconf is not None:
            question = DNSOutgoing(_QUERY)
            question.add_question(DNSQuestion(SERVICE, _POINTER, _INTERNET))
            self._zeroconf.zeroconf.async_send(question)

    def _find_unused(self, interfaces: Sequence[Interface]) -> dict[str, Problem]:
        """The interfaces without a socket that sends there for every kind of address they have."""
        assert self._zeroconf is not None
        senders = {_unscoped(s.sock_name[0]) for s in self._zeroconf.zeroconf.engine.senders}
        unused = {}
        for one in interfaces:
            kinds = {":" in host for host in one.hosts} - {":" in h for h in senders & {*one.hosts}}
            if kinds and not (Flags.LOOPBACK in one.flags and kinds == {True}):
                unused[one.name] = _not_joined(one, len(interfaces))
        return unused


def _choice(interfaces: Sequence[Interface]) -> list[str | int]:
    """What zeroconf is to use: of each interface one IPv4 address, and IPv6 by an address of the
    link if there is one: hosts that hear another cannot tell which link the sender's are of."""
    choice: list[str | int] = []
    links = Counter(host for one in interfaces for host in one.hosts if _is_of_link(host))
    for one in interfaces:
        choice.extend([host for host in one.hosts if ":" not in host][:1])
        sixes = [host for host in one.hosts if ":" in host]
        if sixes and Flags.LOOPBACK not in one.flags:  # where IPv6 has no multicast
            choice.append(sixes[0] if links[sixes[0]] == 1 else one.index)
    return choice


def _info(announcement: Announcement, interfaces: Sequence[Interface]) -> AsyncServiceInfo:
    hosts = announcement.hosts
    if announcement.is_everywhere:
        hosts = tuple(host for one in interfaces for host in one.hosts)
    return AsyncServiceInfo(
        SERVICE,
        instance(announcement.key),
        port=announcement.port,
        properties=to_txt(announcement),
        server=f"nondum-{fingerprint(announcement.key)}.local.",
        parsed_addresses=[_unscoped(host) for host in hosts][:MAX_ADDRESSES],
    )


def _records(info: AsyncServiceInfo) -> tuple[Any, ...]:
    return info.port, info.text, tuple(info.parsed_addresses())


def _is_of_link(host: str) -> bool:
    return ip_address(host).is_link_local and ":" in host


def _unscoped(host: str) -> str:
    return host.partition("%")[0]


def _not_joined(interface: Interface, joined: int) -> Problem:
    limit = memberships()
    if limit is not None and joined > limit:
        return Problem(
            "MULTICAST_MEMBERSHIPS",
            f"the system does not let one program listen on {joined} interfaces",
            where=interface.name,
            need=str(joined),
            have=str(limit),
            fix=f"sysctl -w net.ipv4.igmp_max_memberships={2 * joined}",
        )
    return Problem(
        "MULTICAST_NOT_JOINED",
        "multicast cannot be used there for every kind of address, as yet",
        where=interface.name,
        fix="nothing, if it was plugged in just now; else look with `nondum doctor network`",
    )


def _unusable(error: Exception) -> Problem:
    return Problem(
        "MULTICAST_UNUSABLE",
        f"other hosts cannot be looked for by multicast: {error}",
        where="UDP port 5353",
        fix="look at which programs have UDP port 5353; hosts in `peers.static` are asked still",
    )
