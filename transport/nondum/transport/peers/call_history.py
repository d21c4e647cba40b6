"""At most once: which of a peer's calls were seen already, in bounded memory. Pure.

A caller numbers its calls upwards and repeats, in their order, those that were unanswered when a
link broke. So a number above the highest one seen is new, and every other was seen.
"""

from __future__ import annotations

from collections import OrderedDict
from enum import Enum

from nondum.sdk.frozen import frozen


class Seen(Enum):
    """What a call's number says."""

    NEW = "new"
    RUNNING = "running"
    ANSWERED = "answered"
    """Its answer is kept."""
    FORGOTTEN = "forgotten"
    """It was carried out, or begun, but its answer is kept no more."""


@frozen
class Bounds:
    """How much is kept of answers that the caller has not settled."""

    answers: int = 256
    size: int = 4 << 20
    """Bytes."""


class CallHistory:
    """The memory of one peer's calls in one epoch of it."""

    def __init__(self, bounds: Bounds | None = None) -> None:
        self._bounds = bounds or Bounds()
        self._highest = 0
        self._running: set[int] = set()
        self._answers: OrderedDict[int, bytes] = OrderedDict()
        self._size = 0

    @property
    def size(self) -> int:
        """Bytes of answers that are kept."""
        return self._size

    @property
    def kept(self) -> int:
        """How many answers are kept."""
        return len(self._answers)

    def take(self, number: int) -> Seen:
        """Look at a call that came; a new one is running from now on.

        >>> once = CallHistory()
        >>> once.take(1), once.take(1), once.answered(1, b"yes"), once.take(1)
        (<Seen.NEW: 'new'>, <Seen.RUNNING: 'running'>, None, <Seen.ANSWERED: 'answered'>)
        """
        if number > self._highest:
            self._highest = number
            self._running.add(number)
            return Seen.NEW
        if number in self._running:
            return Seen.RUNNING
        return Seen.ANSWERED if number in self._answers else Seen.FORGOTTEN

    def answered(self, number: int, answer: bytes) -> None:
        """Keep the answer of a running call; beyond the limits the oldest answers are dropped."""
        self._running.discard(number)
        self._answers[number] = answer
        self._size += len(answer)
        while len(self._answers) > self._bounds.answers or self._size > self._bounds.size:
            self._size -= len(self._answers.popitem(last=False)[1])

    def answer(self, number: int) -> bytes:
        """The answer that is kept. Raises `KeyError`."""
        return self._answers[number]

    def settle(self, below: int) -> None:
        """The caller has all answers to calls with lower numbers: forget them.

        Answers are kept in the order of their giving, so this looks at the oldest only; what stays
        behind a younger one goes later, or when the limits are reached.
        """
        while self._answers:
            number, answer = next(iter(self._answers.items()))
            if number >= below:
                return
            del self._answers[number]
            self._size -= len(answer)
