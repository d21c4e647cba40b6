"""What a PTU-D46 answers: replies and limit hits, found in a stream of bytes.

Source: Directed Perception, PTU-D46 User's Manual, version 2.14.0 (2006), section 4.2. A success is
`* text`, a failure `! text`, both up to the end of the line; `!P` and `!T`, without a blank, come
at any time and say that an axis ran into its end. Pure: no clock, no port.
"""

from __future__ import annotations

from dataclasses import dataclass

_AXES = {"P": "pan", "T": "tilt"}


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to one command."""

    is_success: bool
    text: str


@dataclass(frozen=True, slots=True)
class LimitHit:
    """An axis ran into its end: the unit has lost count of its steps."""

    axis: str


class Replies:
    """Cuts bytes into replies; echoed commands and line ends between them are passed over.

    >>> replies = Replies()
    >>> replies.feed(b"PP * 2"), replies.feed(b"2\\r\\n!P")
    ([], [Reply(is_success=True, text='22'), LimitHit(axis='pan')])
    """

    def __init__(self) -> None:
        self._text = ""

    def feed(self, data: bytes) -> list[Reply | LimitHit]:
        """Take the next bytes, give what they complete, in order."""
        self._text += data.decode("ascii", "replace")
        found: list[Reply | LimitHit] = []
        while (piece := self._next()) is not None:
            found.append(piece)
        return found

    def clear(self) -> None:
        """Forget what has come so far."""
        self._text = ""

    def _next(self) -> Reply | LimitHit | None:
        self._text = self._text[_first_mark(self._text) :]
        if self._text[:1] == "!" and self._text[1:2] in _AXES:
            axis, self._text = _AXES[self._text[1]], self._text[2:]
            return LimitHit(axis)
        line, end, rest = self._text.replace("\n", "\r").partition("\r")
        if not end or len(self._text) < 2:
            return None
        self._text = rest
        return Reply(line[0] == "*", line[1:].strip())


def _first_mark(text: str) -> int:
    places = [place for mark in "*!" if (place := text.find(mark)) >= 0]
    return min(places, default=len(text))
