"""This host's session with a Zenoh router: who is present there, and messages to and fro.

Everything of the library eclipse-zenoh is used here and nowhere else: its callbacks come on its own
threads and hop to the loop; what may wait for the network runs on one more thread. Shared memory is
off: a router took hundreds of megabytes for it.

Below `nondum/FLEET`, where a place is `KEY/EPOCH` with the key in hexadecimal:
`here/PLACE` liveliness, `to/PLACE/PLACE/NUMBER` a message to the first place from the second,
`all/PLACE` a message to everybody.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import re
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.wire_fields import MAX_ID
from nondum.transport.peers.drained import AT_ONCE, Sent
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.messages import MAX_MESSAGE

if TYPE_CHECKING:
    import zenoh

log = logging.getLogger(__name__)

WAITING_BYTES = 32 << 20
"""Bytes of messages that may wait to be sent, or to be taken in."""
CONNECT_S = 1.0
"""How long one attempt to reach a router may take, and the wait between two."""
LAST_WORDS_S = 1.0
"""How long messages may take to leave at the end."""


class Place(NamedTuple):
    """One life of a host, as the router's others see it."""

    key: PeerKey
    epoch: int

    def __str__(self) -> str:
        return f"{self.key.encode().hex()}/{self.epoch}"


@frozen
class RouterAccess:
    """How to reach the routers of a fleet."""

    fleet: str
    """What tells fleets apart that share a router: letters, digits, `-` and `_`."""
    endpoints: tuple[str, ...]
    """Any one of them will do: `tls/router.example:7447`, as Zenoh writes them."""
    authorities: Path | None = None
    """Certificates (PEM) that the router's must come from; None for those that Zenoh knows."""
    certificate: Path | None = None
    """This host's, for a router that asks for one."""
    private_key: Path | None = None

    def check(self) -> None:
        """Refuse what cannot work. Raises `PeerRefused` (ADDRESS_MALFORMED, FLEET_NAME)."""
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", self.fleet):
            told = "the name of a fleet has letters, digits, - and _"
            raise PeerRefused(Problem("FLEET_NAME", told, have=repr(self.fleet)[:80]))
        for endpoint in self.endpoints or ("",):
            if not re.fullmatch(r"[a-z]+/\S+:\d+\S*", endpoint):
                told = (
                    "an endpoint of a router is PROTOCOL/HOST:PORT, for example tls/10.0.0.1:7447"
                )
                raise PeerRefused(Problem("ADDRESS_MALFORMED", told, have=endpoint))

    def to_config(self) -> zenoh.Config:
        """The settings of a session. Raises `PeerRefused` (ZENOH_MISSING, ADDRESS_MALFORMED)."""
        library = _library()
        config: zenoh.Config = library.Config()
        try:
            for name, value in self._settings().items():
                config.insert_json5(name, json.dumps(value))
        except library.ZError as error:
            told = f"Zenoh does not take these settings: {error}"
            raise PeerRefused(Problem("ADDRESS_MALFORMED", told[:1000])) from error
        return config

    def _settings(self) -> dict[str, Any]:
        tls = {
            "root_ca_certificate": self.authorities,
            "connect_certificate": self.certificate,
            "connect_private_key": self.private_key,
        }
        given = {f"transport/link/tls/{name}": str(path) for name, path in tls.items() if path}
        if self.certificate:
            given["transport/link/tls/enable_mtls"] = True  # type: ignore[assignment]  # JSON
        return {
            "mode": "client",
            "connect/endpoints": list(self.endpoints),
            "connect/timeout_ms": round(CONNECT_S * 1000),
            "scouting/multicast/enabled": False,
            "transport/shared_memory/enabled": False,
            "transport/link/rx/max_message_size": 2 * MAX_MESSAGE,
            **given,
        }


@frozen
class Listeners:
    """Callbacks for what arrives; called on the loop."""

    present: Callable[[Place, bool], None]
    """A host appeared, or is gone. Also this one."""
    message: Callable[[Place, int, bytes], None]
    """A message to this host, with its number."""
    to_all: Callable[[Place, bytes], None]


class _Arrived(NamedTuple):
    """Something that came, on its way to the loop."""

    take: Callable[[], None]
    size: int


class Line:
    """The session, which is opened again and again until there is a router."""

    def __init__(self, access: RouterAccess, me: Place, listeners: Listeners) -> None:
        """Made on the running loop. Raises `PeerRefused` as `RouterAccess.to_config`."""
        access.check()
        self._config, self._root, self._me = access.to_config(), f"nondum/{access.fleet}", me
        self._listeners = listeners
        self._loop = asyncio.get_running_loop()
        self._arrived: deque[_Arrived] = deque()
        self._arrived_bytes = 0
        self._is_woken = False
        self._waiting: deque[tuple[str, bytes]] = deque()
        self._waiting_bytes = 0
        self._has_work = threading.Condition()
        self._declared: tuple[object, ...] = ()
        """Kept, since Zenoh undeclares an object without references."""
        self._session: zenoh.Session | None = None
        self._failure = "none has answered yet"
        self._is_closed = False
        self._thread = threading.Thread(target=self._work, name="zenoh", daemon=True)
        self.opened = asyncio.Event()
        """Set once a router was reached."""

    def start(self) -> None:
        """Reach a router, and stay with it; returns at once."""
        self._thread.start()

    @property
    def problem(self) -> Problem | None:
        """ROUTER_UNREACHED while no router is reached: a session looks for it ever after."""
        if self._session is None:
            told = self._failure
        elif self._session.info.routers_zid():
            return None
        else:
            told = "its connection has ended"
        return Problem("ROUTER_UNREACHED", f"no Zenoh router is reached: {told}"[:1000])

    def send(self, to: Place, number: int, data: bytes) -> Sent:
        """Send a message to one host, without waiting."""
        return self._put(f"{self._root}/to/{to}/{self._me}/{number}", data)

    def send_all(self, data: bytes) -> Sent:
        """Send a message to everybody, without waiting."""
        return self._put(f"{self._root}/all/{self._me}", data)

    async def close(self) -> None:
        """Let what waits leave, and end the session."""
        with self._has_work:
            self._is_closed = True
            self._has_work.notify()
        if self._thread.is_alive():
            await asyncio.to_thread(self._thread.join, CONNECT_S + LAST_WORDS_S)

    def _put(self, key: str, data: bytes) -> Sent:
        with self._has_work:
            if self._is_closed or self._session is None:
                return Sent.GONE
            if self._waiting_bytes > WAITING_BYTES:
                return Sent.FULL
            self._waiting.append((key, data))
            self._waiting_bytes += len(data)
            self._has_work.notify()
        return Sent.SENT

    def _work(self) -> None:
        """The thread's: what may wait for the network."""
        session = self._open()
        if session is None:
            return
        try:
            while batch := self._batch():
                for key, data in batch:
                    self._put_now(session, key, data)
        finally:
            session.close()  # type: ignore[no-untyped-call]  # so it is in Zenoh's stubs

    def _batch(self) -> list[tuple[str, bytes]]:
        with self._has_work:
            while not self._waiting and not self._is_closed:
                self._has_work.wait()
            batch = list(self._waiting)
            self._waiting.clear()
            self._waiting_bytes = 0
        return batch

    def _put_now(self, session: zenoh.Session, key: str, data: bytes) -> None:
        library = _library()
        try:
            session.put(key, data, congestion_control=library.CongestionControl.BLOCK)
        except library.ZError as error:  # the session mends itself; what was said is lost
            log.info("a message was not sent: %s", error)

    def _open(self) -> zenoh.Session | None:
        library = _library()
        while not self._is_closed:
            try:
                session: zenoh.Session = library.open(self._config)
            except library.ZError as error:
                self._failure = str(error).partition(" at /")[0]  # a place in its source follows
                with self._has_work:
                    self._has_work.wait(CONNECT_S)
                continue
            with self._has_work:
                self._session = session  # before others learn of this one, and greet it
            self._declare(session)
            self._hop(self.opened.set)
            return session
        return None

    def _declare(self, session: zenoh.Session) -> None:
        """Listen first, then look who is there, and be seen last."""
        root, presence = self._root, session.liveliness()
        self._declared = (
            session.declare_subscriber(f"{root}/to/{self._me}/*/*/*", self._on_message),
            session.declare_subscriber(f"{root}/all/*/*", self._on_to_all),
            presence.declare_subscriber(f"{root}/here/*/*", self._on_presence, history=True),
            presence.declare_token(f"{root}/here/{self._me}"),
        )

    # On Zenoh's threads.

    def _on_message(self, sample: zenoh.Sample) -> None:
        *_, key, epoch, number = str(sample.key_expr).split("/")
        place = _read_place(key, epoch)
        if place is not None and number.isdecimal() and len(number) <= 16:
            data = sample.payload.to_bytes()
            self._hop(lambda: self._listeners.message(place, int(number), data), len(data))

    def _on_to_all(self, sample: zenoh.Sample) -> None:
        *_, key, epoch = str(sample.key_expr).split("/")
        place = _read_place(key, epoch)
        if place is not None and place != self._me:
            data = sample.payload.to_bytes()
            self._hop(lambda: self._listeners.to_all(place, data), len(data))

    def _on_presence(self, sample: zenoh.Sample) -> None:
        *_, key, epoch = str(sample.key_expr).split("/")
        place = _read_place(key, epoch)
        if place is not None:
            is_there = sample.kind == _library().SampleKind.PUT
            self._hop(lambda: self._listeners.present(place, is_there))

    def _hop(self, take: Callable[[], None], size: int = 0) -> None:
        """Have the loop take something in; messages are dropped when it is far behind."""
        if size and self._arrived_bytes > WAITING_BYTES:
            return
        self._arrived_bytes += size
        self._arrived.append(_Arrived(take, size))
        if not self._is_woken:
            self._is_woken = True
            with contextlib.suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._take)

    def _take(self) -> None:
        """On the loop again."""
        self._is_woken = False
        for _ in range(AT_ONCE):
            if not self._arrived or self._is_closed:
                return
            arrived = self._arrived.popleft()
            self._arrived_bytes -= arrived.size
            arrived.take()
        self._is_woken = True
        self._loop.call_soon(self._take)


def _library() -> Any:
    try:
        import zenoh
    except ImportError as error:
        raise PeerRefused(
            Problem(
                "ZENOH_MISSING",
                "fleets over a Zenoh router need the package eclipse-zenoh",
                fix="pip install 'nondum[zenoh]'",
            )
        ) from error
    return zenoh


def _read_place(key: str, epoch: str) -> Place | None:
    """None for what no host has declared."""
    try:
        place = Place(PeerKey(bytes.fromhex(key).decode("ascii")), int(epoch))
    except (ValueError, NondumError):
        return None
    return place if 0 < place.epoch <= MAX_ID and str(place) == f"{key}/{epoch}" else None
