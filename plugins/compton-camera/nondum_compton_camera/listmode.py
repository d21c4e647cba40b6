"""The Compton camera's serial list-mode protocol, version 1: bytes in, records out.

    sync EB 90 | type u8 | length u8 | payload | CRC-16 u16        (all little endian)

The CRC is CRC-16/CCITT-FALSE (polynomial 0x1021, initial 0xFFFF) over type, length and payload.
Records: docs/compton-listmode.md. Pure: no clock, no port.
"""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass

SYNC = b"\xeb\x90"
EVENT = 0x01
STATUS = 0x02

_HEAD = len(SYNC) + 2
_CRC = struct.Struct("<H")
_EVENT = struct.Struct("<IQhhhHhhhH")
_STATUS = struct.Struct("<III")
_LENGTHS = {EVENT: _EVENT.size, STATUS: _STATUS.size}
_PER_MM = 100
_PER_KEV = 10


@dataclass(frozen=True, slots=True)
class Interaction:
    """One place where a photon left energy in the detector."""

    position_mm: tuple[float, float, float]
    """In the instrument's own frame (REP-103 axes), from its centre."""
    energy_kev: float


@dataclass(frozen=True, slots=True)
class Event:
    """Two interactions in coincidence. Their order in time is below the electronics' resolution."""

    sequence: int
    """Counts every event that the instrument saw, so that gaps tell of lost ones."""
    time_ns: int
    """The instrument's own clock, from power-up."""
    first: Interaction
    second: Interaction


@dataclass(frozen=True, slots=True)
class Status:
    """What the instrument says about itself, once a second."""

    live_ms: int
    events: int
    lost: int
    """Events that did not fit on the line."""


class Decoder:
    """Finds records in a stream of bytes that may start anywhere and hold anything.

    >>> frame = bytes.fromhex("eb90 020c e8030000 07000000 00000000 54ec")
    >>> decoder = Decoder()
    >>> decoder.feed(b"noise" + frame[:3]), decoder.feed(frame[3:])
    ([], [Status(live_ms=1000, events=7, lost=0)])
    >>> decoder.discarded
    5
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.discarded = 0
        """Bytes that belonged to no valid frame."""

    def feed(self, data: bytes) -> list[Event | Status]:
        """Take the next bytes, give the records they complete, in order.

        A frame whose length or CRC is wrong costs its first byte only: what looked like a frame may
        hide a real one. Frames of unknown type with a right CRC are passed over.
        """
        self._buffer += data
        records: list[Event | Status] = []
        while (frame := self._next_frame()) is not None:
            if (record := _record(*frame)) is not None:
                records.append(record)
        return records

    def _next_frame(self) -> tuple[int, bytes] | None:
        """Cut the next valid frame off the buffer; None: more bytes are needed."""
        while self._skip_to_sync():
            if len(self._buffer) < _HEAD:
                return None
            kind, length = self._buffer[2], self._buffer[3]
            if length != _LENGTHS.get(kind, length):
                self._discard(1)
                continue
            end = _HEAD + length
            if len(self._buffer) < end + _CRC.size:
                return None
            if _CRC.unpack_from(self._buffer, end)[0] != crc(bytes(self._buffer[2:end])):
                self._discard(1)
                continue
            payload = bytes(self._buffer[_HEAD:end])
            del self._buffer[: end + _CRC.size]
            return kind, payload
        return None

    def _skip_to_sync(self) -> bool:
        """Drop bytes before the next sync word; False: there is none yet."""
        start = self._buffer.find(SYNC)
        if start >= 0:
            self._discard(start)
            return True
        half = self._buffer.endswith(SYNC[:1])
        self._discard(len(self._buffer) - half)
        return False

    def _discard(self, count: int) -> None:
        self.discarded += count
        del self._buffer[:count]


def crc(data: bytes) -> int:
    """CRC-16/CCITT-FALSE.

    >>> hex(crc(b"123456789"))
    '0x29b1'
    """
    return binascii.crc_hqx(data, 0xFFFF)


def _record(kind: int, payload: bytes) -> Event | Status | None:
    if kind == EVENT:
        sequence, time_ns, *hits = _EVENT.unpack(payload)
        return Event(sequence, time_ns, _interaction(hits[:4]), _interaction(hits[4:]))
    if kind == STATUS:
        return Status(*_STATUS.unpack(payload))
    return None


def _interaction(numbers: list[int]) -> Interaction:
    x, y, z, energy = numbers
    return Interaction((x / _PER_MM, y / _PER_MM, z / _PER_MM), energy / _PER_KEV)
