"""Announces this host by DNS-SD over multicast, and hears others. Source: RFC 6762, RFC 6763.

zeroconf does the work. What it does not do by itself: follow the interfaces, and say again and
again that this host is there, so that hosts whose networks meet later find each other too.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import logging
import re
import socket
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

from zeroconf import (  # type: ignore[attr-defined] # zeroconf keeps the DNS… for its callers
    DNSOutgoing,
    DNSPointer,
    DNSQuestion,
    IPVersion,
    RecordUpdate,
    RecordUpdateListener,
    Zeroconf,
)
from zeroconf.asyncio import AsyncServiceInfo, AsyncZeroconf

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.discovery.hint import (
    MAX_ADDRESSES,
    SERVICE,
    Hint,
    Source,
    from_txt,
    instance,
    to_txt,
)
from nondum.transport.discovery.interfaces import Flags, Interface, has_ipv6
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import PeerKey, fingerprint

ASK_AGAIN_S = 1.0
MAX_NAMES = 1024
"""Instance names whose owners are remembered, so that their goodbyes can be told."""
MEMBERSHIPS = Path("/proc/sys/net/ipv4/igmp_max_memberships")
_QUERY, _POINTER, _INTERNET = 0, 12, 1  # RFC 1035: flags, type PTR, class IN


class Multicast:
    """On the air from the first `reconcile` to `close`."""

    def __init__(
        self,
        security: Security,
        *,
        on_hint: Callable[[Hint], None],
        on_gone: Callable[[PeerKey], None],
        on_refused: Callable[[Problem], None],
    ) -> None:
        """Only hosts that are secured alike are told of."""
        self._on_refused = on_refused
        self._ears = _Ears(security, on_hint, on_gone, on_refused)
        self._loop = asyncio.get_running_loop()
        self._zeroconf: AsyncZeroconf | None = None
        self._info: AsyncServiceInfo | None = None
        self._choice: list[str | int] = []
        self._tasks: set[asyncio.Task[Any]] = set()
        self._asking: asyncio.TimerHandle | None = None
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
        except (OSError, RuntimeError) as error:
            self.problem = _unusable(error)
        else:
            self.problem = None
            self.unused = self._find_unused(interfaces)
        self._note_announced(interfaces)

    def announce(self, interfaces: Sequence[Interface]) -> None:
        """Say once more that this host is there."""
        if self._zeroconf is not None and self._info is not None:
            zeroconf = self._zeroconf.zeroconf
            zeroconf.async_send(zeroconf.generate_service_broadcast(self._info, None))
            self._note_announced(interfaces)

    def ask(self) -> None:
        """Ask who is there, now and once more soon."""
        self._ask()
        if self._asking is not None:
            self._asking.cancel()
        self._asking = self._loop.call_later(ASK_AGAIN_S, self._ask)

    async def close(self) -> None:
        """Say goodbye, and let go of everything."""
        if self._asking is not None:
            self._asking.cancel()
        for task in self._tasks:
            task.cancel()
        if self._zeroconf is not None:
            await self._zeroconf.async_unregister_all_services()
            await self._zeroconf.async_close()

    async def _join(self, choice: list[str | int], info: AsyncServiceInfo) -> None:
        if self._zeroconf is None:
            version = IPVersion.All if has_ipv6() else IPVersion.V4Only
            self._zeroconf = AsyncZeroconf(interfaces=choice, ip_version=version)
            self._choice = choice
            zeroconf = self._zeroconf.zeroconf
            await zeroconf.async_wait_for_start()
            zeroconf.async_add_listener(self._ears, None)
        if self._info is None:
            # Names are unique by construction, so nobody need be asked for a second.
            told = self._zeroconf.async_register_service(info, cooperating_responders=True)
            self._keep(await told)
        elif _records(info) != _records(self._info):
            self._keep(await self._zeroconf.async_update_service(info))
        self._info = info
        if choice != self._choice or self.unused:
            self._choice = choice
            await self._zeroconf.async_update_interfaces(interfaces=choice)

    def _keep(self, task: Awaitable[Any]) -> None:
        future = asyncio.ensure_future(task)
        self._tasks.add(future)
        future.add_done_callback(self._tasks.discard)

    def _ask(self) -> None:
        self._asking = None
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

    def _note_announced(self, interfaces: Sequence[Interface]) -> None:
        on_air = (one.name for one in interfaces if one.name not in self.unused)
        self.announced_s = dict.fromkeys(on_air, self._loop.time()) if not self.problem else {}


class _Ears(RecordUpdateListener):
    """Makes hints of records. It hears every announcement, not only those with something new."""

    def __init__(
        self,
        security: Security,
        on_hint: Callable[[Hint], None],
        on_gone: Callable[[PeerKey], None],
        on_refused: Callable[[Problem], None],
    ) -> None:
        self._security = security
        self._on_hint, self._on_gone, self._on_refused = on_hint, on_gone, on_refused
        self._zeroconf: Zeroconf | None = None
        self._named: set[str] = set()
        self._owners: dict[str, PeerKey] = {}

    def async_update_records(self, zc: Zeroconf, now: float, records: list[RecordUpdate]) -> None:
        """See which instances a packet is about; what it says is not in the cache yet."""
        self._zeroconf = zc
        for update in records:
            record = update.new
            if isinstance(record, DNSPointer) and record.key == SERVICE:
                if not record.is_expired(now):
                    self._named.add(record.alias)
                elif owner := self._owners.pop(record.alias, None):
                    self._on_gone(owner)
            elif record.key.endswith(SERVICE) and not record.is_expired(now):
                self._named.add(record.name)

    def async_update_records_complete(self) -> None:
        """Read what the packet was about."""
        for name in self._named:
            self._read(name)
        self._named.clear()

    def _read(self, name: str) -> None:
        if not _INSTANCE.fullmatch(name):
            return self._on_refused(_ODD_NAME)
        assert self._zeroconf is not None
        info = AsyncServiceInfo(SERVICE, name)
        if not info.load_from_cache(self._zeroconf):
            return None  # the rest of it is to come
        try:
            txt = {k.decode("ascii"): (v or b"").decode() for k, v in info.properties.items()}
            hosts = [_named_scope(host) for host in info.parsed_scoped_addresses()]
            hint = from_txt(txt, info.port, hosts, source=Source.MULTICAST, security=self._security)
        except UnicodeDecodeError:
            return self._on_refused(_ODD_TEXT)
        except ProtocolViolation as error:
            return self._on_refused(error.problems[0])
        if instance(hint.key) != name:
            return self._on_refused(_ODD_NAME)
        self._remember(name, hint.key)
        return self._on_hint(hint)

    def _remember(self, name: str, owner: PeerKey) -> None:
        self._owners.pop(name, None)
        self._owners[name] = owner
        if len(self._owners) > MAX_NAMES:
            del self._owners[next(iter(self._owners))]


_INSTANCE = re.compile(r"[A-Z2-7]{4}(-[A-Z2-7]{4}){4}\." + re.escape(SERVICE))
_ODD_NAME = Problem("HINT_NAME", "the name that is announced is not made of the key")
_ODD_TEXT = Problem("HINT_MALFORMED", "the TXT record is no text")


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
    return ipaddress.ip_address(host).is_link_local and ":" in host


def _unscoped(host: str) -> str:
    return host.partition("%")[0]


def _named_scope(host: str) -> str:
    """A scope by the interface's name, which lasts, instead of its number."""
    address, percent, scope = host.partition("%")
    if not percent:
        return host
    try:
        return f"{address}%{socket.if_indextoname(int(scope))}"
    except (OSError, ValueError):  # it has gone since
        return address


def _not_joined(interface: Interface, joined: int) -> Problem:
    with contextlib.suppress(OSError, ValueError):
        limit = int(MEMBERSHIPS.read_text())
        if joined > limit:
            return Problem(
                "MULTICAST_MEMBERSHIPS",
                "the system does not let one program listen on so many interfaces",
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
