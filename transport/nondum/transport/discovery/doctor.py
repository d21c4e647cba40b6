"""Whether other hosts can be found over this machine's network, for `nondum doctor network`.

These checks need no daemon, and disturb none: they send one question by multicast DNS, as any host
does, and one question to the process that already listens on this machine.
"""

from __future__ import annotations

import secrets
import socket
import struct
from collections.abc import Iterator, Sequence
from enum import Enum

from nondum.sdk.errors import ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.transport.discovery import packets, udp
from nondum.transport.discovery.interfaces import (
    Flags,
    Interface,
    has_ipv6,
    looked_on,
    memberships,
    read,
)
from nondum.transport.discovery.loopback_test import PORT, LoopbackTest

PATIENCE_S = 0.5


class Result(Enum):
    """How bad it is."""

    OK = "ok"
    WARN = "warn"
    """Hosts may be found, but not all that may be expected."""
    BAD = "bad"
    """Hosts are not found."""


@frozen
class Finding:
    """One thing that was looked at."""

    check: str
    interface: str
    """Empty for the whole machine."""
    result: Result
    detail: str
    fix: str = ""


def examine(port: int) -> tuple[Finding, ...]:
    """Look at everything; `port` is where peers dial. Takes up to a second per interface that does
    not let multicast through."""
    every = read()
    used = looked_on(every)
    found = [judge_interface(one, is_used=one in used) for one in every]
    for one in used:
        found.extend(hear_echo(one))
    found.append(judge_memberships(len(used)))
    found.append(judge_used(used))
    found.extend((try_tcp(port), try_udp(port)))
    found.append(_firewall(port))
    return tuple(found)


def judge_interface(interface: Interface, *, is_used: bool) -> Finding:
    """What an interface's own state says. Pure."""

    def found(result: Result, detail: str, fix: str = "") -> Finding:
        return Finding("interface", interface.name, result, detail, fix)

    addresses = ", ".join(interface.hosts)
    if is_used and Flags.RUNNING in interface.flags:
        return found(Result.OK, f"hosts are looked for there, as {addresses}")
    if is_used:
        told = f"it has an address ({addresses}), but no link"
        return found(Result.WARN, told, "plug the cable in, or join the wireless network")
    if Flags.UP not in interface.flags:
        return found(Result.OK, "not looked on: it is switched off")
    if Flags.LOOPBACK in interface.flags:
        return found(Result.OK, "not looked on: it leads to this machine only")
    if interface.is_virtual:
        return found(Result.OK, "not looked on: it leads to containers or virtual machines only")
    if Flags.MULTICAST not in interface.flags:
        told = "it carries no multicast: hosts behind it must be asked"
        return found(Result.WARN, told, "name them in `peers.static`")
    told = "it has no address"
    return found(Result.WARN, told, "look at DHCP or `ip address`; it is used once it has one")


def judge_used(used: Sequence[Interface]) -> Finding:
    """Whether there is any way to other machines. Pure."""
    if all(Flags.LOOPBACK in one.flags for one in used):
        told = "there is no network: only hosts on this machine can be found"
        fix = "plug a cable in, or join a wireless network; the daemon notices"
        return Finding("network", "", Result.BAD, told, fix)
    names = ", ".join(one.name for one in used)
    return Finding("network", "", Result.OK, f"hosts are looked for on {names}")


def judge_memberships(used: int) -> Finding:
    """Whether one program may listen on `used` interfaces (igmp_max_memberships)."""
    limit = memberships()
    if limit is None:
        return Finding("memberships", "", Result.OK, "this system does not limit them")
    if used <= limit:
        return Finding("memberships", "", Result.OK, f"{used} of {limit} allowed are needed")
    fix = f"sysctl -w net.ipv4.igmp_max_memberships={2 * used}"
    told = f"{used} interfaces are to be listened on, and {limit} may be"
    return Finding("memberships", "", Result.BAD, told, fix)


def hear_echo(interface: Interface) -> Iterator[Finding]:
    """Send a question by multicast DNS, and listen whether it comes back, by each kind of IP."""
    fours = [host for host in interface.hosts if ":" not in host]
    sixes = [host for host in interface.hosts if ":" in host]
    if fours:
        yield _echo(interface, LoopbackTest("224.0.0.251", socket.inet_aton(fours[0])))
    if sixes and has_ipv6() and Flags.LOOPBACK not in interface.flags:
        yield _echo(interface, LoopbackTest("ff02::fb", struct.pack("@I", interface.index)))


def try_tcp(port: int) -> Finding:
    """Whether peers could dial this host, or another program is in the way."""
    check = f"TCP port {port}"
    family = socket.AF_INET6 if has_ipv6() else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            sock.bind(("", port))
            sock.listen()
        except OSError as error:
            return _taken(check, port, error)
    return Finding(check, "", Result.OK, "free: no daemon listens there now")


def try_udp(port: int) -> Finding:
    """Whether hosts that ask are answered, or another program is in the way."""
    check = f"UDP port {port}"
    try:
        udp.bound(udp.ANYWHERE, port).close()
    except OSError as error:
        return _taken(check, port, error)
    return Finding(check, "", Result.OK, "free: no daemon listens there now")


def _taken(check: str, port: int, error: OSError) -> Finding:
    if name := _who_answers(port):
        return Finding(check, "", Result.OK, f"the daemon of {name} listens there")
    told = f"{error.strerror}, and the program that has the port does not answer as a host does"
    fix = "end the other program, or set another port in `peers.listen`"
    return Finding(check, "", Result.BAD, told, fix)


def _who_answers(port: int) -> str:
    """The name of the host that answers on this machine; empty for none."""
    nonce = secrets.token_bytes(packets.NONCE)
    with udp.bound("127.0.0.1", 0) as sock:
        sock.settimeout(PATIENCE_S)
        try:
            sock.sendto(packets.question(nonce), ("127.0.0.1", port))
            answer = packets.read_answer(sock.recv(packets.LENGTH + 1))
        except (OSError, ProtocolViolation):
            return ""
    return answer.txt.get("id", "") if answer.nonce == nonce else ""


def _echo(interface: Interface, test: LoopbackTest) -> Finding:
    try:
        has_come_back = test.has_echo()
    except OSError as error:
        told = f"multicast cannot be used there: {error.strerror or error}"
        fix = f"look at the addresses and routes of {interface.name}, and who has UDP port {PORT}"
        return Finding(test.check, interface.name, Result.BAD, told, fix)
    if has_come_back:
        return Finding(test.check, interface.name, Result.OK, "packets sent there come back here")
    told = "packets sent there do not come back, not even to this machine"
    fix = f"let UDP port {PORT} in and out in this machine's firewall"
    return Finding(test.check, interface.name, Result.BAD, told, fix)


def _firewall(port: int) -> Finding:
    told = "firewalls of other machines, and what switches let through, cannot be seen from here"
    fix = f"every host must let in UDP port {PORT} (multicast), and UDP and TCP port {port}"
    return Finding("firewall", "", Result.OK, told, fix)
