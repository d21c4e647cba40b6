"""Hints: claims where a peer may be, parsed and limited in size, but never trusted.

Two encodings have the same fields: the TXT record of DNS-SD (RFC 6763, section 6), and the answer
to a host that asks (`packets.py`). Whatever a stranger sends, parsing gives a `Hint` or raises
`ProtocolViolation`.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterable, Mapping
from enum import Enum

from nondum.sdk.errors import NondumError, Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.wire_fields import MAX_ID
from nondum.transport.discovery.announcement import DEVELOPMENT, Announcement, security_of
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import PeerKey, fingerprint, parse_key

SERVICE = "_nondum._tcp.local."
"""The type of service that hosts are announced as."""
MAX_ADDRESSES = 16
"""Addresses that are kept of one peer."""
MAX_VERSIONS = 16
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")
_DIGITS = re.compile(r"[1-9][0-9]{0,15}")


class Source(Enum):
    """How a hint came."""

    MULTICAST = "multicast"
    """Any host on the network may have said it."""
    STATIC = "static"
    """The host at an address from `peers.static` said it."""


@frozen
class Hint:
    """A peer may be there."""

    key: PeerKey
    name: str
    epoch: int
    addresses: tuple[str, ...]
    """`tcp://HOST:PORT`, as ZeroMQ takes them: `tcp://[fe80::1%eth0]:7410`. Some may lead nowhere;
    those on a network of this host come first."""
    source: Source
    interface: str = ""
    """Where it was heard, as far as that is known."""
    pairing_port: int | None = None
    versions: tuple[int, ...] = ()


def instance(key: PeerKey) -> str:
    """The name that a host is announced under: no two hosts have one.

    >>> instance(PeerKey("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7"))
    'QQIS-PBOR-BEVH-576C-LECF._nondum._tcp.local.'
    """
    return f"{fingerprint(key)}.{SERVICE}"


def to_txt(announcement: Announcement) -> dict[str, str]:
    """The TXT record of a host.

    >>> to_txt(Announcement(PeerKey("development:rover"), "rover", 7, ("tcp://[::]:7410",)))
    {'id': 'rover', 'pk': 'development:rover', 'epoch': '7', 'proto': '2,1'}
    """
    txt = {
        "id": announcement.name,
        "pk": announcement.key,
        "epoch": str(announcement.epoch),
        "proto": ",".join(str(version) for version in announcement.versions),
    }
    if announcement.pairing_port is not None:
        txt["pair"] = str(announcement.pairing_port)
    return txt


def from_txt(
    txt: Mapping[str, str],
    port: int | None,
    hosts: Iterable[str],
    *,
    source: Source,
    security: Security,
) -> Hint:
    """Read what was said; `hosts` are IP addresses, those of one link with its scope.

    Raises `ProtocolViolation` (HINT_MALFORMED, HINT_SECURITY).
    """
    key = _read_key(txt.get("pk", ""))
    if security_of(key) is not security:
        raise _violation("HINT_SECURITY", "one of the two hosts has no keys")
    name = txt.get("id", "")
    if len(name) > 63 or not _NAME.fullmatch(name):
        raise _violation("HINT_MALFORMED", "the name is none that a host may have")
    versions = txt.get("proto", "").split(",")
    if len(versions) > MAX_VERSIONS:
        raise _violation("HINT_MALFORMED", "it speaks too many versions")
    checked_port = _read_port(str(port))
    return Hint(
        key=key,
        name=name,
        epoch=_read_number(txt.get("epoch", ""), MAX_ID),
        addresses=_addresses(hosts, checked_port),
        source=source,
        pairing_port=_read_port(txt["pair"]) if "pair" in txt else None,
        versions=tuple(_read_number(version, MAX_ID) for version in versions),
    )


def address_at(host: str, port: int) -> str:
    """An IP address and port, as ZeroMQ takes them.

    >>> address_at("10.77.0.2", 7410), address_at("fe80::1%eth0", 7410)
    ('tcp://10.77.0.2:7410', 'tcp://[fe80::1%eth0]:7410')
    """
    return f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"


def host_of(address: str) -> str:
    """The IP address in an address; its scope stays.

    >>> host_of("tcp://[fe80::1%eth0]:7410")
    'fe80::1%eth0'
    """
    return address.removeprefix("tcp://").rpartition(":")[0].strip("[]")


def _addresses(hosts: Iterable[str], port: int) -> tuple[str, ...]:
    found: dict[str, None] = {}
    for host in hosts:
        try:
            ipaddress.ip_address(host)
        except ValueError:
            continue
        found[address_at(host, port)] = None
    return tuple(found)


def _read_key(text: str) -> PeerKey:
    if text.startswith(DEVELOPMENT):
        name = text.removeprefix(DEVELOPMENT)
        if len(name) > 63 or not _NAME.fullmatch(name):
            raise _violation("HINT_MALFORMED", "the key is none")
        return PeerKey(text)
    try:
        return parse_key(text)
    except NondumError as error:
        raise _violation("HINT_MALFORMED", "the key is none") from error


def _read_port(text: str) -> int:
    return _read_number(text, 65_535)


def _read_number(text: str, most: int) -> int:
    if not _DIGITS.fullmatch(text) or int(text) > most:
        raise _violation("HINT_MALFORMED", f"expected a positive whole number, found {text!r:.40}")
    return int(text)


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
