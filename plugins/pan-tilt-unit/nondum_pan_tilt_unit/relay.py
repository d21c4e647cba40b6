"""The laser's switch: a one-channel USB relay with a CH340, known as LCUS-1.

9600 baud; each command is A0, channel, 1 (on) or 0 (off), and the sum of the three. The relay never
answers, and keeps its state until told otherwise or unplugged.
"""

from __future__ import annotations

from nondum.sdk.serial_line import SerialLine

BAUD = 9600
_START = 0xA0


def command(channel: int, *, on: bool) -> bytes:
    """The bytes that switch a channel.

    >>> command(1, on=True).hex(" "), command(1, on=False).hex(" ")
    ('a0 01 01 a2', 'a0 01 00 a1')
    """
    body = (_START, channel, int(on))
    return bytes((*body, sum(body) & 0xFF))


class Laser:
    """A laser on channel 1 of a relay. Switching is one short write: it needs no event loop."""

    def __init__(self, line: SerialLine) -> None:
        self._line = line

    def on(self) -> None:
        self._line.send(command(1, on=True))

    def off(self) -> None:
        self._line.send(command(1, on=False))
