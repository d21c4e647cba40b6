"""Makes hints of what is heard over multicast. Source: RFC 6762, RFC 6763."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Iterable
from ipaddress import ip_address

from zeroconf import (  # type: ignore[attr-defined] # zeroconf keeps the DNS… for its callers
    DNSAddress,
    DNSPointer,
    DNSText,
    RecordUpdate,
    RecordUpdateListener,
    Zeroconf,
)
from zeroconf.asyncio import AsyncServiceInfo

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.transport.discovery.hint import SERVICE, Hint, Source, from_txt, instance
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import PeerKey

MAX_NAMES = 1024
"""Instance names whose owners are remembered, so that their goodbyes can be told."""


class MdnsListener(RecordUpdateListener):
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
        self._texts: dict[str, bytes] = {}
        self._ends: dict[str, set[str]] = {}
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
                if isinstance(record, DNSText):
                    self._texts[record.name] = record.text
            elif isinstance(record, DNSAddress) and not record.is_expired(now):
                self._ends.setdefault(record.key, set()).add(str(ip_address(record.address)))

    def async_update_records_complete(self) -> None:
        """Read what the packet was about."""
        for name in self._named:
            self._read(name)
        self._named.clear()
        self._texts.clear()
        self._ends.clear()

    def _read(self, name: str) -> None:
        if not _INSTANCE.fullmatch(name):
            return self._on_refused(_ODD_NAME)
        assert self._zeroconf is not None
        info = AsyncServiceInfo(SERVICE, name)
        if not info.load_from_cache(self._zeroconf):
            return None  # the rest of it is to come
        try:
            txt = {k.decode("ascii"): (v or b"").decode() for k, v in self._properties(info)}
            hosts = [_named_scope(host) for host in self._hosts(info)]
            hint = from_txt(txt, info.port, hosts, source=Source.MULTICAST, security=self._security)
        except UnicodeDecodeError:
            return self._on_refused(_ODD_TEXT)
        except ProtocolViolation as error:
            return self._on_refused(error.problems[0])
        if instance(hint.key) != name:
            return self._on_refused(_ODD_NAME)
        self._remember(name, hint.key)
        return self._on_hint(hint)

    def _properties(self, info: AsyncServiceInfo) -> Iterable[tuple[bytes, bytes | None]]:
        """The TXT record of the packet: of two in the cache, it is unknown which is newer."""
        if (text := self._texts.get(info.name)) is not None:
            info = AsyncServiceInfo(SERVICE, info.name, properties=text)
        return info.properties.items()

    def _hosts(self, info: AsyncServiceInfo) -> list[str]:
        """Its addresses, less those that the packet does not name any more: the cache keeps them
        for a second, and for longer when they were named a moment ago."""
        hosts = info.parsed_scoped_addresses()
        ends = self._ends.get(info.server_key or "")
        return hosts if ends is None else [host for host in hosts if host.partition("%")[0] in ends]

    def _remember(self, name: str, owner: PeerKey) -> None:
        self._owners.pop(name, None)
        self._owners[name] = owner
        if len(self._owners) > MAX_NAMES:
            del self._owners[next(iter(self._owners))]


_INSTANCE = re.compile(r"[A-Z2-7]{4}(-[A-Z2-7]{4}){4}\." + re.escape(SERVICE))
_ODD_NAME = Problem("HINT_NAME", "the name that is announced is not made of the key")
_ODD_TEXT = Problem("HINT_MALFORMED", "the TXT record is no text")


def _named_scope(host: str) -> str:
    """A scope by the interface's name, which lasts, instead of its number."""
    address, percent, scope = host.partition("%")
    if not percent:
        return host
    try:
        return f"{address}%{socket.if_indextoname(int(scope))}"
    except (OSError, ValueError):  # it has gone since
        return address
