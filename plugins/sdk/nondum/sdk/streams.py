"""One stream's way from its producer to each of its consumers on the same host.

Each pair has its own connection; the host brokers it and is out of the data path. Frames lie
in shared slots (`nondum.sdk.slots`), small messages travel inline. A few messages are outstanding
per consumer; while they are, the newest one waits and older ones are dropped, so that a slow,
stopped or dead consumer costs its producer nothing. Only messages cross: no shared counters.

A consumer's code looks at frames where they lie, two at a time: the one that it works on and the
one before or after. Further ones are copied out, so that keeping frames never stops a stream.

    producer → consumer   [0, seq, header, bytes or nil]         a message, inline
                          [1, seq, slot, length, header]         a message in a slot; the first time
                                                                 with the slot's descriptor
                          [2, slot]                              the slot is retired
    consumer → producer   [seq]                                  the message has been read
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Sequence
from typing import Any

from nondum.sdk.errors import MessageInvalid, Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.messages import Buffer, Message, message_from_wire
from nondum.sdk.packets import Handle, Packets, PausablePackets, discard
from nondum.sdk.slots import MAX_SLOT_BYTES, MappedSlots, Slot, SlotRing
from nondum.sdk.wire import MAX_PACKET, pack, unpack

LENT = 2
"""Frames that a consumer's code may look at in their slots."""
OUTSTANDING = LENT + 1
"""Messages that a consumer may hold: one more, to be copied out or replaced by a newer one."""
INLINE_BYTES = 16 * 1024
"""Bulk bytes up to here travel in the packet."""
SPARE_SLOTS = 2
"""One that waits for slow consumers and one that is being written."""
QUIET_S = 0.2
"""After a message, releases are read with the next one, or when this time is over: a producer is
woken by none of them as long as it sends."""
UNLIMITED = 2**31
"""Packets that never leave the process may be this long."""

_INLINE, _IN_SLOT, _RETIRED = range(3)


@frozen
class _Frame:
    """A message, ready for any number of consumers."""

    seq: int
    packet: bytes
    slot: Slot | None = None


@frozen
class _Joined:
    """Bulk bytes that lie in a slot already."""

    data: memoryview
    slot: Slot


class Producer:
    """The sending end of a stream. Its methods run on the loop."""

    def __init__(self, kind: str, on_lost: Callable[[str], None] = lambda consumer: None) -> None:
        """Begin without consumers.

        `on_lost` is called when a consumer is gone, or was cut off because it broke the protocol;
        not after `disconnect`.
        """
        self.kind = kind
        """The stream's type."""
        self._on_lost = on_lost
        self._outlets: dict[str, _Outlet] = {}
        self._ring = SlotRing()
        self._seq = 0
        self._sent_s = 0.0
        self._listens: asyncio.TimerHandle | None = None
        """None: releases are read as they come."""
        self._joined: _Joined | None = None
        """For the next message; no slot is let go of until that is sent."""

    def connect(self, consumer: str, packets: PausablePackets) -> None:
        """Feed one more consumer, from the next message on; owns `packets`."""
        self.disconnect(consumer)
        self._outlets[consumer] = _Outlet(packets, lambda: self._lose(consumer))

    @property
    def consumers(self) -> tuple[str, ...]:
        """Names of those who are fed."""
        return tuple(self._outlets)

    @property
    def slots_held(self) -> int:
        """Slots that a consumer reads, or will."""
        return self._ring.held

    def disconnect(self, consumer: str) -> None:
        """Stop feeding a consumer; unknown ones are ignored."""
        outlet = self._outlets.pop(consumer, None)
        if outlet is not None:
            outlet.close()
            self._retire()

    def send(self, message: Message) -> None:
        """Hand a message to every consumer that can take it; never waits.

        Raises `MessageInvalid` for wrong values, a header that fits no packet, and more data than
        a reader takes.
        """
        joined, self._joined = self._joined, None
        message.check()
        if not self._outlets:
            return
        header, buffer = message.to_wire()
        length = 0 if buffer is None else memoryview(buffer).nbytes
        _check_length(length)
        if joined is None:
            self._take_in()
        self._seq += 1
        shared = [outlet for outlet in self._outlets.values() if outlet.packets.shares_memory]
        apart = [outlet for outlet in self._outlets.values() if not outlet.packets.shares_memory]
        if buffer is not None and length > INLINE_BYTES and shared:
            is_there = joined is not None and joined.data is buffer
            slot = joined.slot if joined and is_there else self._written((buffer,), length)
            if slot is not None:  # or all are being read: this frame is dropped for all
                self._offer(shared, self._in_slot(slot, header, length))
        elif shared:
            self._offer(shared, self._inline(header, buffer, MAX_PACKET))
        if apart:
            self._offer(apart, self._inline(header, buffer, UNLIMITED))
        self._pause()

    def joined(self, pieces: Sequence[Buffer]) -> Buffer:
        """Bulk bytes that have come in pieces as one, for the next message that is sent: that need
        not copy them once more, if any consumer shares memory.

        Raises `OSError` when the system has no memory or descriptors left.
        """
        if len(pieces) == 1:
            return pieces[0]
        length = sum(memoryview(piece).nbytes for piece in pieces)
        slot = None
        self._take_in()
        if any(outlet.packets.shares_memory for outlet in self._outlets.values()):
            slot = self._written(pieces, length)
        if slot is None:
            return b"".join(pieces)
        self._joined = _Joined(memoryview(slot.memory)[:length].toreadonly(), slot)
        return self._joined.data

    def close(self) -> None:
        """End the stream for all consumers."""
        for consumer in list(self._outlets):
            self.disconnect(consumer)
        self._ring.close()
        if self._listens is not None:
            self._listens.cancel()

    def _lose(self, consumer: str) -> None:
        self.disconnect(consumer)
        self._on_lost(consumer)

    def _pause(self) -> None:
        loop = asyncio.get_running_loop()
        self._sent_s = loop.time()
        if self._listens is None:
            self._listens = loop.call_later(QUIET_S, self._listen)
        for outlet in self._outlets.values():
            outlet.pause()

    def _listen(self) -> None:
        """Read releases as they come, once nothing was sent for a while."""
        loop = asyncio.get_running_loop()
        left_s = self._sent_s + QUIET_S - loop.time()
        if left_s > 0:
            self._listens = loop.call_later(left_s, self._listen)
            return
        self._listens = None
        for outlet in tuple(self._outlets.values()):
            outlet.listen()

    def _inline(self, header: dict[str, Any], buffer: Buffer | None, limit: int) -> _Frame:
        return _Frame(self._seq, _packed([_INLINE, self._seq, header, buffer], limit))

    def _in_slot(self, slot: Slot, header: dict[str, Any], length: int) -> _Frame:
        fields = [_IN_SLOT, self._seq, slot.id, length, header]
        return _Frame(self._seq, _packed(fields, MAX_PACKET), slot)

    def _written(self, pieces: Sequence[Buffer], length: int) -> Slot | None:
        """A slot with these bytes; None: all are being read."""
        self._retire(length)
        return self._ring.write(pieces, length)

    def _take_in(self) -> None:
        """Read the releases that have come, and the ends of consumers."""
        for outlet in tuple(self._outlets.values()):
            outlet.take_in()

    def _offer(self, outlets: list[_Outlet], frame: _Frame) -> None:
        for outlet in outlets:
            outlet.offer(frame)

    def _retire(self, length: int = 0) -> None:
        keep = OUTSTANDING * len(self._outlets) + SPARE_SLOTS
        for slot_id in self._ring.retire(keep, length):
            for outlet in self._outlets.values():
                outlet.forget(slot_id)


class _Outlet:
    """What a producer knows of one consumer."""

    def __init__(self, packets: PausablePackets, on_closed: Callable[[], None]) -> None:
        self.packets = packets
        self._on_closed = on_closed
        self._outstanding: dict[int, _Frame] = {}
        self._newest: _Frame | None = None
        self._mapped: set[int] = set()
        self._is_listening = True
        packets.open(self._released, lambda _violation: on_closed())

    def take_in(self) -> None:
        """Read the releases that have come."""
        if not self._is_listening:
            self.packets.take_in()

    def pause(self) -> None:
        """Be woken by no release, unless a message waits for one."""
        if self._is_listening and self._newest is None:
            self._is_listening = False
            self.packets.pause()

    def listen(self) -> None:
        """Read releases as they come."""
        if not self._is_listening:
            self._is_listening = True
            self.packets.resume()

    def offer(self, frame: _Frame) -> None:
        """Send a message now, or let it wait in place of an older one."""
        _hold(frame)
        if self._newest is not None:
            _drop(self._newest)
        self._newest = frame
        self._send_newest()

    def forget(self, slot_id: int) -> None:
        """Tell the consumer that a slot is gone."""
        if slot_id in self._mapped:
            self._mapped.discard(slot_id)
            # Nothing is outstanding in that slot, so at most a few such notices can be under way.
            self.packets.send(pack([_RETIRED, slot_id]))

    def close(self) -> None:
        """Take back all that the consumer held."""
        self.packets.close()
        for frame in self._outstanding.values():
            _drop(frame)
        self._outstanding.clear()
        if self._newest is not None:
            _drop(self._newest)
            self._newest = None

    def _send_newest(self) -> None:
        frame = self._newest
        if frame is None:
            return
        if len(self._outstanding) >= OUTSTANDING:
            self.listen()
            return
        is_new = frame.slot is not None and frame.slot.id not in self._mapped
        handles = (frame.slot.descriptor,) if frame.slot is not None and is_new else ()
        if not self.packets.send(frame.packet, handles):
            self.listen()
            self.packets.when_writable(self._send_newest)
            return
        if frame.slot is not None:
            self._mapped.add(frame.slot.id)
        self._outstanding[frame.seq] = frame
        self._newest = None

    def _released(self, data: bytes, handles: tuple[Handle, ...]) -> None:
        discard(handles)
        try:
            match unpack(data):
                case [int(seq)] if seq in self._outstanding and not handles:
                    _drop(self._outstanding.pop(seq))
                    self._send_newest()
                case _:
                    self._on_closed()
        except ProtocolViolation:
            self._on_closed()


@frozen
class _Waiting:
    """A message that has arrived and was not taken yet."""

    seq: int
    header: dict[str, Any]
    inline: bytes | None = None
    slot: int | None = None
    length: int = 0


class Consumer:
    """The receiving end of a stream; keeps only the newest message until it is taken."""

    def __init__(
        self,
        kind: str,
        packets: Packets,
        on_message: Callable[[], None],
        on_closed: Callable[[ProtocolViolation | None], None],
    ) -> None:
        """Own `packets` and begin to read.

        `on_message` is called whenever a newer message waits. `on_closed` is called once when the
        producer is gone (None) or broke the protocol; not after `close`.
        """
        self._kind, self._packets = kind, packets
        self._on_message, self._on_closed = on_message, on_closed
        self._slots = MappedSlots()
        self._loop = asyncio.get_running_loop()
        self._thread = threading.get_ident()
        self._waiting: _Waiting | None = None
        self.number = 0
        """The message that was taken last, as its producer counts what it sends: from 1."""
        self._limit = MAX_PACKET if packets.shares_memory else UNLIMITED
        packets.open(self._receive, self._lose)

    def take(self) -> Message | None:
        """Give the waiting message; None when none waits.

        Its bulk data may lie in shared memory: read-only, and unchanged as long as anything looks
        at them. Raises `MessageInvalid` when it is not what its type says, `ProtocolViolation` when
        its slot was taken away.
        """
        waiting, self._waiting = self._waiting, None
        if waiting is None:
            return None
        self.number = waiting.seq
        if waiting.slot is None:
            buffer: Buffer | None = waiting.inline
            self._release(waiting.seq)
        elif self._slots.lent < LENT:
            seq = waiting.seq
            buffer = self._slots.lend(waiting.slot, waiting.length, lambda: self._give_back(seq))
        else:
            buffer = self._slots.copy(waiting.slot, waiting.length)
            self._release(waiting.seq)
        return message_from_wire(self._kind, waiting.header, buffer)

    def close(self) -> None:
        """Stop reading."""
        self._waiting = None
        self._packets.close()
        self._slots.close()

    def _receive(self, data: bytes, handles: tuple[Handle, ...]) -> None:
        unclaimed = list(handles)
        try:
            self._accept(unpack(data, self._limit), unclaimed)
            if unclaimed:
                raise ProtocolViolation(
                    Problem("PACKET_DESCRIPTORS", "a packet carries unexpected descriptors")
                )
        except ProtocolViolation as violation:
            self._lose(violation)
        finally:
            discard(unclaimed)

    def _accept(self, fields: Any, handles: list[Handle]) -> None:
        match fields:
            case [0, int(seq), dict(header), bytes() | None as buffer]:
                self._replace(_Waiting(seq, header, inline=buffer))
            case [1, int(seq), int(slot), int(length), dict(header)]:
                if handles:
                    self._slots.add(slot, handles.pop(0))
                self._slots.check(slot, length)
                self._replace(_Waiting(seq, header, slot=slot, length=length))
            case [2, int(slot)]:
                self._slots.remove(slot)
            case _:
                raise ProtocolViolation(Problem("STREAM_PACKET", "no packet of a stream"))

    def _replace(self, newer: _Waiting) -> None:
        older, self._waiting = self._waiting, newer
        if older is not None:
            self._release(older.seq)
        self._on_message()

    def _give_back(self, seq: int) -> None:
        """Release a frame that no reader uses any more, from whichever thread."""
        if threading.get_ident() == self._thread:
            self._release(seq)
        else:
            with contextlib.suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(self._release, seq)

    def _release(self, seq: int) -> None:
        # A producer that lets releases pile up until the socket is full harms only itself.
        self._packets.send(pack([seq]))

    def _lose(self, violation: ProtocolViolation | None) -> None:
        self._packets.close()
        self._on_closed(violation)
        self.close()


def _check_length(length: int) -> None:
    """A reader would take a longer one for a breach of the protocol, and the sender never know."""
    if length > MAX_SLOT_BYTES:
        told, need = "its data are too long for one message", f"at most {MAX_SLOT_BYTES} bytes"
        fix = "send less at once: a smaller image, or several messages"
        raise MessageInvalid(
            Problem("MESSAGE_TOO_LONG", told, need=need, have=f"{length} bytes", fix=fix)
        )


def _packed(fields: list[Any], limit: int) -> bytes:
    try:
        return pack(fields, limit)
    except ProtocolViolation as violation:
        raise MessageInvalid(
            Problem("MESSAGE_TOO_LONG", f"the message fits no packet: {violation}")
        ) from violation


def _hold(frame: _Frame) -> None:
    if frame.slot is not None:
        frame.slot.readers += 1


def _drop(frame: _Frame) -> None:
    if frame.slot is not None:
        frame.slot.readers -= 1
