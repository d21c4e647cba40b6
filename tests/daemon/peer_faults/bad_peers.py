"""What a host does that was let in and has gone bad, or was taken over:
`python -m tests.daemon.peer_faults.bad_peers KIND IP PORT KEY PUBLIC SECRET`.

Each goes on until it is killed, and tells on standard output when it has been let in.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import zmq

from nondum.sdk.errors import ProtocolViolation
from nondum.sdk.wire import pack
from nondum.transport.fleet.chunk import MAX_ENTRY, Chunk
from nondum.transport.fleet.ledger import Ledger
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


@dataclass
class Bad:
    """A host's end of one link, at which everything may be said."""

    endpoint: str
    key: str
    public: str
    secret: str
    context: zmq.Context[zmq.Socket[bytes]] = field(default_factory=zmq.Context)
    term: int = 0
    beats: int = 0
    beaten_s: float = 0.0

    def dial(self) -> None:
        """Connect, and be let in. Raises `OSError` when it is not."""
        self.term += 1
        self.socket = self.context.socket(zmq.DEALER)
        self.socket.linger = 0
        self.socket.sndhwm = self.socket.rcvhwm = 10_000
        self.socket.reconnect_ivl = 1 << 30
        self.socket.rcvtimeo = self.socket.sndtimeo = PATIENCE_MS
        self.socket.curve_publickey = self.public.encode()
        self.socket.curve_secretkey = self.secret.encode()
        self.socket.curve_serverkey = self.key.encode()
        self.ears = self.socket.get_monitor_socket(
            zmq.EVENT_DISCONNECTED | zmq.EVENT_HANDSHAKE_FAILED_AUTH
        )
        self.socket.connect(self.endpoint)
        self.say(Hello((1,), "bad", self.public, EPOCH, self.term, b""))
        poller = zmq.Poller()
        poller.register(self.socket, zmq.POLLIN)
        poller.register(self.ears, zmq.POLLIN)
        found = dict(poller.poll(PATIENCE_MS))
        if self.socket not in found or not isinstance(decode(self.socket.recv()), Welcome):
            raise ConnectionRefusedError

    def hang_up(self) -> None:
        """End it."""
        self.socket.disable_monitor()
        self.ears.close(0)
        self.socket.close(0)

    def say(self, message: Message) -> None:
        """Say something. Raises `zmq.Again` when nothing can be said for two seconds."""
        self.socket.send(encode(message))

    def live(self, state: State | None = None) -> None:
        """Give a sign of life, when it is time to. Raises `ConnectionResetError`."""
        if self.ears.poll(0):
            raise ConnectionResetError
        if time.monotonic() - self.beaten_s > BEAT_S:
            self.beaten_s = time.monotonic()
            self.beats += 1
            self.say(Ping(self.beats, int(BEAT_S * 1000), state))

    def heard(self, wait_s: float = 0.0) -> Iterator[Message]:
        """What has come."""
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
            list(bad.heard())
        yield


def endless_calls(bad: Bad) -> Iterator[None]:
    """Have more begun than any host would, and none of it end."""
    number = 0
    while True:
        number += 1
        bad.live()
        args = {"piece": f"bad-{number}", "for_s": 1000}
        bad.say(Request(number, 1, 10_000_000, "work.stop", args))
        list(bad.heard(0.001))
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
            for message in bad.heard():
                if isinstance(message, Request) and message.method == "fleet.read":
                    bad.say(Reply(message.number, ledger.whole()[-1].to_body()))
        yield


def oversized(bad: Bad) -> Iterator[None]:
    """Answer whoever asks for the catalogue with more than any host may have."""
    state = State(9, bytes(8))
    entry = pack({"text": "x" * (MAX_ENTRY - 100)}, MAX_ENTRY)
    while True:
        bad.live(state)
        for message in bad.heard(BEAT_S):
            if isinstance(message, Request) and message.method == "fleet.read":
                for part in range(127):
                    chunk = Chunk(EPOCH, 0, state, part, 128, {f"fact/{part}": entry})
                    bad.say(Progress(message.number, chunk.to_body()))
                chunk = Chunk(EPOCH, 0, state, 127, 128, {"fact/127": entry})
                bad.say(Reply(message.number, chunk.to_body()))
        yield


def mute(bad: Bad) -> Iterator[None]:
    """Have news all the time, and never answer who asks for them."""
    while True:
        bad.live(State(bad.beats + 1, bytes(8)))
        list(bad.heard(BEAT_S))
        yield


def late(bad: Bad) -> Iterator[None]:
    """Answer when nobody waits any more, twice, and what nobody has asked."""
    waiting: deque[tuple[float, Request]] = deque()
    while True:
        bad.live()
        for message in bad.heard(BEAT_S):
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
            list(bad.heard())
        yield


def greetings(bad: Bad) -> Iterator[None]:
    """Be let in, again and again."""
    while True:
        bad.hang_up()
        try:
            bad.dial()
        finally:
            yield


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
    )
}


def main(kind: str, ip: str, port: str, key: str, public: str, secret: str) -> None:
    """Be bad, and come back when cut."""
    bad = Bad(f"tcp://{ip}:{port}", key, public, secret)
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
