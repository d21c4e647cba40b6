"""Bytes as SSH writes them (RFC 4251, section 5), read to the last one."""

from __future__ import annotations

MAX_STRING = 4096
"""Longest string that a key or signature holds here; the longest real one has 70 bytes."""


class Malformed(Exception):
    """Bytes that are not what they should be; says what, for the problem that is told."""


class Reader:
    """Takes the parts of a value, one after the other; `end` it. Each raises `Malformed`."""

    def __init__(self, data: bytes) -> None:
        self._data = data

    def take(self, count: int) -> bytes:
        """The next `count` bytes."""
        if len(self._data) < count:
            raise Malformed("it is cut off")
        taken, self._data = self._data[:count], self._data[count:]
        return taken

    def uint32(self) -> int:
        """A number of four bytes."""
        return int.from_bytes(self.take(4), "big")

    def string(self) -> bytes:
        """A string with its length before it."""
        length = self.uint32()
        if length > MAX_STRING:
            raise Malformed(f"it holds a string of {length} bytes")
        return self.take(length)

    def text(self) -> str:
        """A string of printable ASCII."""
        data = self.string()
        if not all(0x20 < byte < 0x7F for byte in data):
            raise Malformed("a name in it is not printable ASCII")
        return data.decode("ascii")

    def end(self) -> None:
        """See that nothing is left."""
        if self._data:
            raise Malformed(f"{len(self._data)} bytes follow its end")


def string(data: bytes) -> bytes:
    """A string as it is written.

    >>> string(b"ssh")
    b'\\x00\\x00\\x00\\x03ssh'
    """
    return len(data).to_bytes(4, "big") + data
