"""What strangers do to a host that listens.

    python -m tests.daemon.peer_faults.attacks KIND IP PORT KEY

Each goes on until it is killed, and tells on standard output that it has begun. `KEY` is the public
key of the host, which everybody on its network can hear.
"""

from __future__ import annotations

import contextlib
import os
import random
import selectors
import socket
import struct
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator

import zmq
from tests.transport.discovery.spoofing import GROUP, announced

from nondum.transport.discovery.hint import instance
from nondum.transport.peers import HostKeys, PeerKey

AT_ONCE = 64
HALF_OPEN = 1000
GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x01" + b"CURVE".ljust(20, b"\0") + bytes(32)
"""RFC 23/ZMTP: what every connection begins with."""
LONG, MORE, COMMAND = b"\x02", b"\x03", b"\x06"
"""Flags of a frame that is long; that has more after it; that is a command."""


def unknown_keys(ip: str, port: int, key: str) -> Iterator[None]:
    """Connect by CURVE, each time under a key that no host trusts."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    waiting: deque[tuple[zmq.Socket[bytes], zmq.Socket[bytes]]] = deque()
    while True:
        keys = HostKeys.generate()
        sock = context.socket(zmq.DEALER)
        sock.linger = 0
        sock.curve_publickey, sock.curve_secretkey = keys.public.encode(), keys.secret.encode()
        sock.curve_serverkey = key.encode()
        monitor = sock.get_monitor_socket(zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_DISCONNECTED)
        sock.connect(f"tcp://{ip}:{port}")
        waiting.append((sock, monitor))
        if len(waiting) > AT_ONCE:
            sock, monitor = waiting.popleft()
            monitor.poll(1000)  # it is turned away, and not just gone before that
            sock.disable_monitor()
            monitor.close(0)
            sock.close(0)
        yield


def other_mechanisms(ip: str, port: int, key: str) -> Iterator[None]:
    """Connect without any keys, or with a password."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    waiting: deque[zmq.Socket[bytes]] = deque()
    while True:
        sock = context.socket(zmq.DEALER)
        sock.linger = 0
        if len(waiting) % 2:
            sock.plain_username, sock.plain_password = b"root", b"root"
        sock.connect(f"tcp://{ip}:{port}")
        with contextlib.suppress(zmq.Again):  # it was turned away already
            sock.send(b"hello", zmq.DONTWAIT)
        waiting.append(sock)
        if len(waiting) > AT_ONCE:
            waiting.popleft().close(0)
        time.sleep(0.002)
        yield


def garbage(ip: str, port: int, key: str) -> Iterator[None]:
    """Say what is no ZeroMQ."""
    noises = (b"GET / HTTP/1.1\r\n\r\n" * 20, b"\xff" * 400, bytes(400))
    while True:
        with contextlib.suppress(OSError), socket.create_connection((ip, port), 5) as sock:
            sock.sendall(random.choice([*noises, os.urandom(4096), GREETING + os.urandom(4096)]))
        yield


def slow(ip: str, port: int, key: str) -> Iterator[None]:
    """Begin a thousand greetings at once, one byte a second, and again when cut."""
    said: dict[socket.socket, int] = {}
    while True:
        while len(said) < HALF_OPEN:
            with contextlib.suppress(OSError):
                said[socket.create_connection((ip, port), 5)] = 0
            yield
        for sock, done in list(said.items()):
            try:
                sock.sendall(GREETING[done : done + 1])
                said[sock] = done + 1
            except OSError:
                sock.close()
                del said[sock]
        time.sleep(1.0)


def long_frames(ip: str, port: int, key: str) -> Iterator[None]:
    """Announce a frame of 2 GB, or one of as many bytes as can be written down."""
    while True:
        for flags in (LONG, MORE, COMMAND):
            for length in (1 << 31, (1 << 64) - 1, 1 << 63):
                header = flags + struct.pack(">Q", length)
                with contextlib.suppress(OSError), socket.create_connection((ip, port), 5) as sock:
                    sock.sendall(GREETING + header)
                    sock.sendall(bytes(100_000))
                yield


def endless(ip: str, port: int, key: str) -> Iterator[None]:
    """Send parts, and commands, that are well formed and never end."""
    poll = selectors.DefaultSelector()
    part = MORE + struct.pack(">Q", 60_000) + bytes(60_000)
    command = COMMAND + struct.pack(">Q", 60_000) + b"\x05HELLO" + bytes(59_994)
    while True:
        while len(poll.get_map()) < AT_ONCE:
            with contextlib.suppress(OSError):
                sock = socket.create_connection((ip, port), 5)
                sock.sendall(GREETING)
                sock.setblocking(False)
                poll.register(sock, selectors.EVENT_WRITE, random.choice([part, command]))
        for ready, _ in poll.select(1.0):
            assert isinstance(ready.fileobj, socket.socket)
            try:
                ready.fileobj.send(ready.data)
            except BlockingIOError:
                continue
            except OSError:
                poll.unregister(ready.fileobj)
                ready.fileobj.close()
        yield


def spoofed(ip: str, port: int, key: str) -> Iterator[None]:
    """Announce hosts that do not exist, and the real one where it is not."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.connect((ip, port))  # nothing is sent: this tells which interface leads there
    own = socket.inet_aton(sock.getsockname()[0])
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, own)
    number = 0
    while True:
        number += 1
        liar = PeerKey(key) if number % 3 == 0 else HostKeys.generate().public
        name = random.choice(["rover", "mule", f"liar-{number}"])
        epoch = str(random.randrange(1, 1 << 50))
        txt = {"id": name, "pk": liar, "epoch": epoch, "proto": "1"}
        nowhere = f"10.77.0.{random.randrange(100, 250)}"
        ttl = random.choice([0, 120, 120])
        sock.sendto(announced(instance(liar), txt, [nowhere], ttl=ttl), GROUP)
        time.sleep(0.001)
        yield


KINDS: dict[str, Callable[[str, int, str], Iterator[None]]] = {
    attack.__name__: attack
    for attack in (unknown_keys, other_mechanisms, garbage, slow, long_frames, endless, spoofed)
}

if __name__ == "__main__":
    kind, ip, port, key = sys.argv[1:]
    attack = KINDS[kind](ip, int(port), key)
    next(attack)
    sys.stdout.write("begun\n")
    sys.stdout.flush()
    for _ in attack:
        pass
