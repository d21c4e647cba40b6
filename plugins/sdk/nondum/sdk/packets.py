"""Packets between two ends: over a SOCK_SEQPACKET socket, or in memory for tests.

The seam under links and streams (unix(7), SCM_RIGHTS). A packet arrives whole, in order, with the
*handles* that were sent along: descriptors over a socket.
"""

from __future__ import annotations

import array
import asyncio
import errno
import os
import socket
from collections.abc import Callable, Sequence
from typing import Protocol, TypeAlias, Union

from nondum.sdk.errors import Problem, ProtocolViolation

MAX_HANDLES = 4
"""Descriptors in one packet."""
BATCH = 8
"""Packets read before the loop gets its turn: a flood cannot starve the rest."""
CROWDED_S = 0.02
"""Before another attempt where too many descriptors of this user are under way."""
CROWDED_TRIES = 250
"""Attempts of those that can wait for only so long."""

# Plain numbers: on every packet, the socket module's enums would cost as much as the system call.
_CUT_SHORT = int(socket.MSG_TRUNC | socket.MSG_CTRUNC)
_CLOSE_ON_EXEC = int(socket.MSG_CMSG_CLOEXEC)

Handle: TypeAlias = Union[int, "PausablePackets"]
"""What a packet can carry to a new connection: a descriptor, or an end in memory."""
OnPacket: TypeAlias = Callable[[bytes, tuple[Handle, ...]], None]
OnClosed: TypeAlias = Callable[[ProtocolViolation | None], None]


class Packets(Protocol):
    """One end of a connection."""

    shares_memory: bool
    """Whether memory can be handed over by descriptor."""

    def open(self, on_packet: OnPacket, on_closed: OnClosed) -> None:
        """Begin to read, on the running loop.

        `on_packet` owns the handles it gets. `on_closed` is called once, unless `close` came first,
        when the other end is gone (None) or broke the limits of packets.
        """
        ...

    def send(self, data: bytes, handles: Sequence[Handle] = ()) -> bool:
        """Send a packet now, or answer False, with nothing sent, when the other end is slow.

        The caller keeps its handles. What is sent to an end that is gone disappears.
        """
        ...

    def when_writable(self, callback: Callable[[], None]) -> None:
        """Call back once, as soon as `send` may succeed again."""
        ...

    def close(self) -> None:
        """Stop and let go. Closing twice is allowed."""
        ...


class PausablePackets(Packets, Protocol):
    """One end that need not be woken by each packet that comes."""

    def pause(self) -> None:
        """Read no more until `resume`, but by `take_in`."""
        ...

    def resume(self) -> None:
        """Read again as it comes."""
        ...

    def take_in(self) -> None:
        """Read now what has come, some of it at least."""
        ...


class SocketPackets:
    """Packets over a non-blocking AF_UNIX SOCK_SEQPACKET socket, which it owns."""

    shares_memory = True

    def __init__(
        self,
        sock: socket.socket,
        limit: int,
        max_handles: int = MAX_HANDLES,
        on_crowded: Callable[[], None] = lambda: None,
    ) -> None:
        """`on_crowded` is called for each packet that cannot be sent yet since too many descriptors
        of this user, by whichever process, were sent and not read (ETOOMANYREFS, unix(7))."""
        sock.settimeout(0)
        self._sock = sock
        self._limit = limit
        self._max_handles = max_handles
        self._ancillary = socket.CMSG_SPACE(MAX_HANDLES * array.array("i").itemsize)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._on_crowded = on_crowded
        self._is_crowded = False
        self._retry: asyncio.TimerHandle | None = None

    def open(self, on_packet: OnPacket, on_closed: OnClosed) -> None:
        """Begin to read (see `Packets`)."""
        self._on_packet, self._on_closed = on_packet, on_closed
        self._loop = asyncio.get_running_loop()
        self.resume()

    def send(self, data: bytes, handles: Sequence[Handle] = ()) -> bool:
        """Send a packet (see `Packets`)."""
        if self._sock.fileno() < 0:
            return True
        try:
            if handles:
                socket.send_fds(self._sock, [data], [h for h in handles if isinstance(h, int)])
            else:
                self._sock.send(data)
        except (BlockingIOError, InterruptedError):
            return False
        except OSError as error:
            if error.errno == errno.ETOOMANYREFS:  # nothing is wrong with either end
                self._is_crowded = True
                self._on_crowded()
                return False
            # EPIPE, ECONNRESET: the reader reports them, in a later turn of the loop.
            if self._loop is not None:
                self._loop.call_soon(self._lose, None)
        return True

    def when_writable(self, callback: Callable[[], None]) -> None:
        """Call back once (see `Packets`)."""
        if self._loop is None or self._sock.fileno() < 0:
            return
        loop, descriptor = self._loop, self._sock.fileno()
        self._forget_retry()
        if self._is_crowded:  # the socket is writable, and will not tell
            self._is_crowded = False
            self._retry = loop.call_later(CROWDED_S, callback)
            return

        def writable() -> None:
            loop.remove_writer(descriptor)
            callback()

        loop.add_writer(descriptor, writable)

    def pause(self) -> None:
        """Read only when told to (see `PausablePackets`)."""
        if self._loop is not None and self._sock.fileno() >= 0:
            self._loop.remove_reader(self._sock.fileno())

    def resume(self) -> None:
        """Read again as it comes (see `PausablePackets`)."""
        if self._loop is not None and self._sock.fileno() >= 0:
            self._loop.add_reader(self._sock.fileno(), self.take_in)

    def close(self) -> None:
        """Stop reading and close the socket."""
        if self._sock.fileno() < 0:
            return
        if self._loop is not None:
            self._loop.remove_reader(self._sock.fileno())
            self._loop.remove_writer(self._sock.fileno())
        self._forget_retry()
        self._sock.close()

    def _forget_retry(self) -> None:
        if self._retry is not None:
            self._retry.cancel()
            self._retry = None

    def take_in(self) -> None:
        """Read what has come, `BATCH` packets at most."""
        for _ in range(BATCH):
            if self._sock.fileno() < 0:
                return  # closed by what a packet led to
            try:
                data, ancillary, flags, _ = self._sock.recvmsg(
                    self._limit + 1, self._ancillary, _CLOSE_ON_EXEC
                )
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                data, ancillary, flags = b"", [], 0
            handles = _descriptors(ancillary) if ancillary else ()
            if not data:
                _close_all(handles)
                self._lose(None)
                return
            problem = self._broken(flags, len(handles))
            if problem is not None:
                _close_all(handles)
                self._lose(ProtocolViolation(problem))
                return
            self._on_packet(data, handles)

    def _broken(self, flags: int, handles: int) -> Problem | None:
        if not flags & _CUT_SHORT and handles <= self._max_handles:
            return None
        if flags & socket.MSG_TRUNC:
            return Problem("PACKET_TOO_LONG", f"a packet is longer than {self._limit} bytes")
        return Problem(
            "PACKET_DESCRIPTORS", f"a packet carries more than {self._max_handles} descriptors"
        )

    def _lose(self, violation: ProtocolViolation | None) -> None:
        if self._sock.fileno() >= 0:
            self.close()
            self._on_closed(violation)


class MemoryPackets:
    """Packets within one process and loop: for tests, and for systems without such sockets."""

    shares_memory = False

    def __init__(self) -> None:
        self._peer: MemoryPackets | None = None
        self._waiting: list[tuple[bytes, tuple[Handle, ...]]] = []
        self._on_packet: OnPacket | None = None
        self._on_closed: OnClosed | None = None

    @classmethod
    def pair(cls) -> tuple[MemoryPackets, MemoryPackets]:
        """Make two connected ends."""
        one, other = cls(), cls()
        one._peer, other._peer = other, one
        return one, other

    def open(self, on_packet: OnPacket, on_closed: OnClosed) -> None:
        """Begin to read (see `Packets`)."""
        self._on_packet, self._on_closed = on_packet, on_closed
        loop = asyncio.get_running_loop()
        for data, handles in self._waiting:
            loop.call_soon(self._deliver, data, handles)
        self._waiting.clear()
        if self._peer is None:
            loop.call_soon(self._lose)

    def send(self, data: bytes, handles: Sequence[Handle] = ()) -> bool:
        """Send a packet (see `Packets`); it arrives on a later turn of the loop."""
        peer = self._peer
        if peer is not None and peer._on_packet is None:
            peer._waiting.append((data, tuple(handles)))
        elif peer is not None:
            asyncio.get_running_loop().call_soon(peer._deliver, data, tuple(handles))
        return True

    def when_writable(self, callback: Callable[[], None]) -> None:
        """Call back on the next turn of the loop: memory is always writable."""
        asyncio.get_running_loop().call_soon(callback)

    def pause(self) -> None:
        """Do nothing: the other end delivers."""

    def resume(self) -> None:
        """Do nothing (see `pause`)."""

    def take_in(self) -> None:
        """Do nothing (see `pause`)."""

    def close(self) -> None:
        """Let go of the other end, which is told."""
        peer, self._peer, self._on_packet, self._on_closed = self._peer, None, None, None
        if peer is not None:
            peer._peer = None
            if peer._on_closed is not None:
                asyncio.get_running_loop().call_soon(peer._lose)

    def _deliver(self, data: bytes, handles: tuple[Handle, ...]) -> None:
        if self._on_packet is not None:
            self._on_packet(data, handles)

    def _lose(self) -> None:
        on_closed, self._on_packet, self._on_closed = self._on_closed, None, None
        if on_closed is not None:
            on_closed(None)


def adopt(
    handle: Handle, limit: int, on_crowded: Callable[[], None] = lambda: None
) -> PausablePackets:
    """Make an end of a handle that arrived, and own it."""
    if isinstance(handle, int):
        return SocketPackets(socket.socket(fileno=handle), limit, on_crowded=on_crowded)
    return handle


def discard(handles: Sequence[Handle]) -> None:
    """Close handles that are not needed."""
    for handle in handles:
        if isinstance(handle, int):
            os.close(handle)
        else:
            handle.close()


def _descriptors(ancillary: list[tuple[int, int, bytes]]) -> tuple[int, ...]:
    found = array.array("i")
    for level, kind, data in ancillary:
        if level == socket.SOL_SOCKET and kind == socket.SCM_RIGHTS:
            found.frombytes(data[: len(data) - len(data) % found.itemsize])
    return tuple(found)


def _close_all(handles: tuple[int, ...]) -> None:
    for handle in handles:
        os.close(handle)
