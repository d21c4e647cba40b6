"""What a host does that was let in and has gone bad, or was taken over:
`python -m tests.daemon.peer_faults.bad_peers KIND IP PORT KEY PUBLIC SECRET [FLEET]`.

FLEET is the secret key of a fleet that certifies it, in hexadecimal digits.
Each goes on until it is killed, and tells on standard output when it has been let in.
"""

from __future__ import annotations

import base64
import contextlib
import itertools
import random
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta

import zmq

from nondum.sdk.errors import ProtocolViolation
from nondum.sdk.wire import pack
from nondum.transport.fleet.chunk import MAX_ENTRY, Chunk, cut, digest_of
from nondum.transport.fleet.ledger import Ledger
from nondum.transport.peers import HostKeys, PeerKey
from nondum.transport.peers.certificate import Certificate, FleetKey, issue
from nondum.transport.peers.ed25519 import SigningKey
from nondum.transport.peers.messages import (
    Hello,
    Message,
    Notice,
    Ping,
    Progress,
    Reply,
    Request,
    Welcome,
    decode,
    encode,
)
from nondum.transport.peers.pulse import State

BEAT_S = 0.2
LATE_S = 0.6
PATIENCE_MS = 2000
EPOCH = 7
PARTS = 8000
"""Of a message that is as good as endless: 800 MB."""
HALF_OPEN = 400
DRIP_S = 0.002
DRIPPED = 4096
"""Bytes that are passed on at once before it drips: a greeting, and news."""


@dataclass
class Bad:
    """A host's end of one link, at which everything may be said."""

    endpoint: str
    key: str
    public: str
    secret: str
    certificate: bytes = b""
    fleet: bytes = b""
    """The secret key of a fleet."""
    context: zmq.Context[zmq.Socket[bytes]] = field(default_factory=zmq.Context)
    term: int = 0
    beats: int = 0
    beaten_s: float = 0.0

    def hello(self) -> Hello:
        """A greeting that is new."""
        self.term += 1
        return Hello((1,), "bad", self.public, EPOCH, self.term, self.certificate)

    def made(self) -> zmq.Socket[bytes]:
        """A socket that proves this host's key."""
        made = self.context.socket(zmq.DEALER)
        made.linger = 0
        made.sndhwm = made.rcvhwm = 10_000
        made.rcvtimeo = made.sndtimeo = PATIENCE_MS
        made.curve_publickey = self.public.encode()
        made.curve_secretkey = self.secret.encode()
        made.curve_serverkey = self.key.encode()
        return made

    def dial(self, hello: Hello | None = None) -> None:
        """Connect, and be let in. Raises `OSError` when it is not."""
        self.socket = self.made()
        self.socket.reconnect_ivl = 1 << 30
        self.monitor = self.socket.get_monitor_socket(
            zmq.EVENT_DISCONNECTED | zmq.EVENT_HANDSHAKE_FAILED_AUTH
        )
        self.socket.connect(self.endpoint)
        self.say(hello or self.hello())
        poller = zmq.Poller()
        poller.register(self.socket, zmq.POLLIN)
        poller.register(self.monitor, zmq.POLLIN)
        found = dict(poller.poll(PATIENCE_MS))
        if self.socket not in found or not isinstance(decode(self.socket.recv()), Welcome):
            raise ConnectionRefusedError

    def hang_up(self) -> None:
        """End it."""
        self.socket.disable_monitor()
        self.monitor.close(0)
        self.socket.close(0)

    def say(self, message: Message) -> None:
        """Say something. Raises `zmq.Again` when nothing can be said for two seconds."""
        self.socket.send(encode(message))

    def live(self, state: State | None = None) -> None:
        """Give a sign of life, when it is time to. Raises `ConnectionResetError`."""
        if self.monitor.poll(0):
            raise ConnectionResetError
        if time.monotonic() - self.beaten_s > BEAT_S:
            self.beaten_s = time.monotonic()
            self.beats += 1
            self.say(Ping(self.beats, int(BEAT_S * 1000), state))

    def received(self, wait_s: float = 0.0) -> Iterator[Message]:
        """The messages that have arrived."""
        while self.socket.poll(int(wait_s * 1000)):
            wait_s = 0.0
            try:
                yield decode(self.socket.recv())
            except ProtocolViolation:
                continue


def calls(bad: Bad) -> Iterator[None]:
    """Call without end, and read no answers but in passing."""
    number = 0
    while True:
        number += 1
        bad.live()
        bad.say(Request(number, number, 60_000, "echo", {"text": "x" * 100}))
        if number % 100 == 0:
            list(bad.received())
        yield


def endless_calls(bad: Bad) -> Iterator[None]:
    """Have more begun than any host would, and none of it end."""
    number = 0
    while True:
        number += 1
        bad.live()
        args = {"piece": f"bad-{number}", "for_s": 1000}
        bad.say(Request(number, 1, 10_000_000, "work.stop", args))
        list(bad.received(0.001))
        yield


def long_notices(bad: Bad) -> Iterator[None]:
    """Tell without end, as much as fits a message."""
    while True:
        bad.live()
        bad.say(Notice("values", {"text": "x" * 100_000}))
        yield


def changes(bad: Bad) -> Iterator[None]:
    """Change the catalogue without end."""
    ledger, told = Ledger(EPOCH), 1
    number = 0
    while True:
        number += 1
        ledger.publish({f"fact/{key}": {"number": number} for key in range(50)})
        bad.live(ledger.state)
        for chunk in ledger.delta(told) or ():
            bad.say(Notice("fleet.changed", chunk.to_body()))
        told = ledger.state.revision
        if number % 20 == 0:
            for message in bad.received():
                if isinstance(message, Request) and message.method == "fleet.read":
                    bad.say(Reply(message.number, ledger.whole()[-1].to_body()))
        yield


def oversized(bad: Bad) -> Iterator[None]:
    """Answer requests for the catalogue with more than any host may have."""
    state = State(9, bytes(8))
    entry = pack({"text": "x" * (MAX_ENTRY - 100)}, MAX_ENTRY)
    while True:
        bad.live(state)
        for message in bad.received(BEAT_S):
            if isinstance(message, Request) and message.method == "fleet.read":
                for part in range(127):
                    chunk = Chunk(EPOCH, 0, state, part, 128, {f"fact/{part}": entry})
                    bad.say(Progress(message.number, chunk.to_body()))
                chunk = Chunk(EPOCH, 0, state, 127, 128, {"fact/127": entry})
                bad.say(Reply(message.number, chunk.to_body()))
        yield


def mute(bad: Bad) -> Iterator[None]:
    """Have news all the time, and answer no request for them."""
    while True:
        bad.live(State(bad.beats + 1, bytes(8)))
        list(bad.received(BEAT_S))
        yield


def late(bad: Bad) -> Iterator[None]:
    """Answer each call after its deadline, twice, and answer calls that no host has made."""
    waiting: deque[tuple[float, Request]] = deque()
    while True:
        bad.live()
        for message in bad.received(BEAT_S):
            if isinstance(message, Request) and message.method == "echo":
                waiting.append((time.monotonic() + LATE_S, message))
        while waiting and waiting[0][0] < time.monotonic():
            number = waiting.popleft()[1].number
            for _ in range(2):
                bad.say(Reply(number, {"answer": "late"}))
                bad.say(Reply(number + 1000, {}))
        yield


def deaf(bad: Bad) -> Iterator[None]:
    """Ask for long answers, and read none of them."""
    number = 0
    while True:
        number += 1
        bad.live()
        bad.say(Request(number, 1, 60_000, "echo", {"text": "x" * 100_000}))
        time.sleep(0.002)
        yield


def reads(bad: Bad) -> Iterator[None]:
    """Ask for the whole catalogue without end."""
    number = 0
    while True:
        number += 1
        bad.live()
        bad.say(Request(number, number, 60_000, "fleet.read", {"epoch": 0, "revision": 0}))
        if number % 10 == 0:
            list(bad.received())
        yield


def greetings(bad: Bad) -> Iterator[None]:
    """Be let in, again and again."""
    while True:
        bad.hang_up()
        try:
            bad.dial()
        finally:
            yield


def endless_parts(bad: Bad) -> Iterator[None]:
    """Say that the next sign of life comes late, and send one message that does not end."""
    bad.say(Ping(1, 10_000))
    part = b"x" * 100_000
    for _ in range(PARTS):
        bad.socket.send(part, zmq.SNDMORE, copy=False)
    bad.socket.send(b"end")  # only now ZeroMQ begins to send
    while not bad.monitor.poll(1000):
        yield
    raise ConnectionResetError


def drip(bad: Bad) -> Iterator[None]:
    """Send one byte at a time."""
    bad.hang_up()
    bad.endpoint = dripping(bad.endpoint)
    while True:
        with contextlib.suppress(OSError):
            bad.dial()
            bad.say(Notice("values", {"text": "x" * 100_000}))
            while not bad.monitor.poll(1000):
                yield
        bad.hang_up()
        time.sleep(BEAT_S)


def half_open(bad: Bad) -> Iterator[None]:
    """Prove the key over many connections, and never greet; ZeroMQ itself dials again."""
    sockets: list[zmq.Socket[bytes]] = []
    try:
        while True:
            bad.live()
            list(bad.received())
            if len(sockets) < HALF_OPEN:
                sockets.append(bad.made())
                sockets[-1].connect(bad.endpoint)
            else:
                time.sleep(BEAT_S)
            yield
    finally:
        for one in sockets:
            one.close(0)


def names(bad: Bad) -> Iterator[None]:
    """Be somebody else each time, or oneself in another life."""
    number = 0
    while True:
        number += 1
        bad.hang_up()
        hello = replace(bad.hello(), epoch=1000 + number)
        if number % 2:
            other = HostKeys.generate().public if number % 4 == 1 else PeerKey(bad.key)
            hello = replace(hello, key=other, name=random.choice(["rover", "base", f"bad{number}"]))
        with contextlib.suppress(OSError):
            bad.dial(hello)
            assert not number % 2, "another key than the proved one was let in"
        yield


def deltas(bad: Bad) -> Iterator[None]:
    """Let the catalogue grow by one change after the other, beyond what any host may have."""
    entry = pack({"text": "x" * (MAX_ENTRY - 100)}, MAX_ENTRY)
    entries: dict[str, bytes] = {}
    digest = 0
    for revision in itertools.count(1):
        state = State(revision, digest.to_bytes(8))
        bad.live(state)
        for message in bad.received(0.02):
            if isinstance(message, Request) and message.method == "fleet.read":
                *first, last = cut(EPOCH, 0, state, entries)
                for chunk in first:
                    bad.say(Progress(message.number, chunk.to_body()))
                bad.say(Reply(message.number, last.to_body()))
        key = f"fact/{revision}"
        entries[key] = entry
        digest ^= digest_of(key, entry)
        now = State(revision + 1, digest.to_bytes(8))
        chunk = Chunk(EPOCH, revision, now, 0, 1, {key: entry})
        bad.say(Notice("fleet.changed", chunk.to_body()))
        yield


def certificates(bad: Bad) -> Iterator[None]:
    """Show certificates with dates that no clock has, or that are over, and then the good one."""
    good = bad.certificate
    while True:
        for certificate in (*ill_dated(bad), good):
            bad.hang_up()
            bad.certificate = certificate
            try:
                bad.dial()
                assert certificate == good, f"let in by {certificate!r}"
            except OSError:
                pass
            finally:
                bad.certificate = good
            yield


def ill_dated(bad: Bad) -> Iterator[bytes]:
    """Certificates for the key, signed by the fleet, that do not hold."""
    signer = SigningKey.of(bad.fleet)
    fleet = base64.b64encode(signer.public).decode()
    now = "2026-01-01T00:00:00Z"
    for begins, ends in (
        ("2000-01-01T00:00:00Z", "2000-01-02T00:00:00Z"),
        ("9999-01-01T00:00:00Z", "9999-12-31T23:59:59Z"),
        ("0001-01-01T00:00:00Z", "0001-01-02T00:00:00Z"),
        ("9999-12-31T23:59:59Z", "0001-01-01T00:00:00Z"),
        (now, now),
        (now, "10000-01-01T00:00:00Z"),
        (now, f"{'9' * 300}-01-01T00:00:00Z"),
        (now, "9999-12-31T23:59:60Z"),
        (now, "9999-13-32T25:61:61Z"),
        (now, "-001-01-01T00:00:00Z"),
        (now, "9999-12-31T23:59:59+14:00"),
        (now, "inf"),
        ("", ""),
    ):
        lines = ["nondum-host-certificate@1", f"fleet: {fleet}", "host: bad", f"key: {bad.public}"]
        lines += [f"not-before: {begins}", f"not-after: {ends}", ""]
        signed = "\n".join(lines).encode()
        yield signed + b"signature: " + base64.b64encode(signer.sign(signed)) + b"\n"
    never = datetime(9999, 12, 31, 23, 59, 59, tzinfo=UTC)
    unsigned = Certificate(FleetKey(fleet), "bad", PeerKey(bad.public), never, never)
    yield unsigned.to_bytes()


def dripping(endpoint: str) -> str:
    """Where to connect to so that all but the first bytes reach `endpoint` one by one."""
    where, _, port = endpoint.removeprefix("tcp://").rpartition(":")
    server = socket.create_server(("127.0.0.1", 0))

    def back(there: socket.socket, here: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := there.recv(1 << 16):
                here.sendall(data)
        with contextlib.suppress(OSError):
            here.shutdown(socket.SHUT_RDWR)

    def forth(here: socket.socket) -> None:
        with contextlib.suppress(OSError), here, socket.create_connection((where, int(port))) as to:
            to.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=back, args=(to, here), daemon=True).start()
            passed = 0
            while data := here.recv(1 if passed >= DRIPPED else DRIPPED - passed):
                to.sendall(data)
                passed += len(data)
                time.sleep(DRIP_S if passed >= DRIPPED else 0)

    def serve() -> None:
        while True:
            threading.Thread(target=forth, args=(server.accept()[0],), daemon=True).start()

    threading.Thread(target=serve, daemon=True).start()
    return f"tcp://127.0.0.1:{server.getsockname()[1]}"


KINDS: dict[str, Callable[[Bad], Iterator[None]]] = {
    kind.__name__: kind
    for kind in (
        calls,
        endless_calls,
        long_notices,
        changes,
        oversized,
        mute,
        late,
        deaf,
        reads,
        greetings,
        endless_parts,
        drip,
        half_open,
        names,
        deltas,
        certificates,
    )
}


def main(
    kind: str, ip: str, port: str, key: str, public: str, secret: str, fleet: str = ""
) -> None:
    """Be bad, and come back when cut."""
    bad = Bad(f"tcp://{ip}:{port}", key, public, secret, fleet=bytes.fromhex(fleet))
    if fleet:
        now, years = datetime.now(UTC), timedelta(days=3650)
        holds = issue(
            bad.fleet, "bad", PeerKey(public), not_before=now - years, not_after=now + years
        )
        bad.certificate = holds.to_bytes()
    while True:
        try:
            bad.dial()
            sys.stdout.write("in\n")
            sys.stdout.flush()
            for _ in KINDS[kind](bad):
                pass
        except (zmq.ZMQError, OSError):
            time.sleep(0.1)  # it was cut, or is not let in
        bad.hang_up()


if __name__ == "__main__":
    main(*sys.argv[1:])
