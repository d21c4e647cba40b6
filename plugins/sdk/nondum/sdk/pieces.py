"""Messages that are longer than a packet, as packets: a byte, 1 for the last piece, and the piece.
Pure."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire import MAX_PACKET

_MORE, _LAST = b"\0", b"\1"
_BYTES = MAX_PACKET - 1
"""Of the message in a packet."""


def cut(message: bytes) -> Iterator[bytes]:
    """The packets of a message.

    >>> [packet[:3] for packet in cut(b"ab" * 40_000)]
    [b'\\x00ab', b'\\x01ba']
    """
    for at in range(0, len(message), _BYTES):
        mark = _MORE if at + _BYTES < len(message) else _LAST
        yield mark + message[at : at + _BYTES]


class Joined:
    """Makes messages of packets."""

    def __init__(self, limit: int) -> None:
        """`limit`: bytes of a message."""
        self._limit = limit
        self._pieces: list[bytes] = []
        self._bytes = 0

    def add(self, packet: bytes) -> bytes | None:
        """Take in the next packet; the message, if it is its last one.

        Raises `ProtocolViolation` (PACKET_TOO_LONG, PACKET_MALFORMED).
        """
        mark, piece = packet[:1], packet[1:]
        self._bytes += len(piece)
        if mark not in (_MORE, _LAST):
            raise ProtocolViolation(Problem("PACKET_MALFORMED", f"no piece begins with {mark!r}"))
        if mark == _MORE and len(piece) != _BYTES:  # so that no message has pieces without end
            raise ProtocolViolation(Problem("PACKET_MALFORMED", "only the last piece is shorter"))
        if self._bytes > self._limit:
            told = f"more than {self._limit} bytes in a message"
            raise ProtocolViolation(Problem("PACKET_TOO_LONG", told))
        self._pieces.append(piece)
        if mark == _MORE:
            return None
        message = b"".join(self._pieces)
        self._pieces.clear()
        self._bytes = 0
        return message
