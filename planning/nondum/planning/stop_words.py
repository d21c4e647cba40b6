"""Words that stop a robot, whatever is plugged in: understood before all phrases. English.

Only a sentence that says nothing else is one of them: "stop" is, "stop following me" is for
phrases. With a name before it that no host has ("river, stop"), it is one unless a phrase says it.
"""

from __future__ import annotations

from nondum.planning.pattern import words_of

STOPS = ("stop", "halt", "freeze", "abort", "stand still", "hold still", "don't move")
"""What to say."""
STOP_PATTERNS = tuple(f"[please] {said} [now]" for said in STOPS)
"""What those who listen are told to hear."""
_TYPED = ("do not move", "whoa")
"""Understood as well, and not listened for: "hello" is heard as "whoa"."""

_ORDERS = tuple(sorted(map(words_of, (*STOPS, *_TYPED)), key=len, reverse=True))
_BESIDE = frozenset(
    {
        *("please", "now", "immediately", "right", "away", "at", "once", "there", "emergency"),
        *("it", "that", "this", "all", "everything", "everybody", "robot", "moving", "everyone"),
    }
)
"""Words that change nothing."""
_LONGEST_NAME = 3
_NO_NAME = frozenset(
    {
        *("not", "never", "don't", "doesn't", "won't", "can't", "cannot", "without", "no"),
        *("to", "at", "of", "how", "when", "why", "where", "what", "if", "until", "bus", "full"),
    }
)
"""No name has them: who says them means something else."""


def is_stop(sentence: str) -> bool:
    """Whether a sentence stops the robot.

    >>> [is_stop(said) for said in ("Stop!", "stop it now, please", "robot, don't move")]
    [True, True, True]
    >>> [is_stop(said) for said in ("stop following me", "please", "")]
    [False, False, False]
    """
    return _stops(words_of(sentence))


def is_stop_for_other(sentence: str) -> bool:
    """Whether a sentence says a word that stops to somebody, by a name that may be misheard.

    >>> [is_stop_for_other(said) for said in ("Rover, stop!", "hey big mule, stop it now")]
    [True, True]
    >>> [is_stop_for_other(said) for said in ("stop", "never stop", "where is the stop")]
    [False, False, False]
    """
    words = words_of(sentence)
    return any(
        _NO_NAME.isdisjoint(words[:length]) and _stops(words[length:])
        for length in range(1, min(_LONGEST_NAME, len(words)) + 1)
    ) and not _stops(words)


def _stops(words: tuple[str, ...]) -> bool:
    left, is_said = words, False
    while left:
        order = next((one for one in _ORDERS if left[: len(one)] == one), None)
        if order is None and left[0] not in _BESIDE:
            return False
        is_said |= order is not None
        left = left[len(order) if order else 1 :]
    return is_said
