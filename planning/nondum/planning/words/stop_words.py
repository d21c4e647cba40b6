"""Words that stop a robot, whatever is plugged in: understood before all phrases. English.

Only a sentence that says nothing else is one of them: "stop" is, "stop following me" is for
phrases. With a name before it that no host has ("river, stop"), it is one unless a phrase says it;
with a name behind it, too ("stop, river"): any host's whole name, or one word that no host has.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from nondum.planning.words.pattern import name_words, words_of

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
_LONGEST_CALL = 20
"""Words of a sentence in which a name behind the word is looked for."""
_NO_NAME = frozenset(
    {
        *("not", "never", "don't", "doesn't", "won't", "can't", "cannot", "without", "no"),
        *("to", "at", "of", "how", "when", "why", "where", "what", "if", "until", "bus", "full"),
    }
)
"""No name has them: who says them means something else."""
_NO_NAME_BEHIND = _NO_NAME | frozenset(
    {
        *("me", "him", "her", "them", "us", "you", "my", "your", "the", "a", "an", "and", "or"),
        *("in", "on", "by", "for", "with", "from", "after", "before", "near", "here"),
    }
)
"""Nor are they one behind the word: the sentence goes on."""
_AT = frozenset({"at"})
_POINTING = _AT | {"this", "that", "all"}
"""What comes next is a thing."""


def stop_patterns(name: str) -> tuple[str, ...]:
    """Patterns for those who listen, in which a `name` may come before the word or behind it.

    >>> stop_patterns("{who}")[0], stop_patterns("{who}")[-1]
    ('[{who}] [please] stop [now]', "[please] don't move {who} [now]")
    """
    behind = (f"[please] {said} {name} [now]" for said in STOPS)
    return (*(f"[{name}] {said}" for said in STOP_PATTERNS), *behind)


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


def host_behind_stop(sentence: str, hosts: Sequence[str]) -> str | None:
    """The host that a sentence stops whose name comes behind the word.

    >>> [host_behind_stop(said, ["big-mule"]) for said in ("Stop the big mule now!", "stop mule")]
    ['big-mule', None]
    """
    names = {name_words((host,)): host for host in hosts}
    longest = 1 + max(map(len, names), default=0)
    said = (name_words(words) for words in _behind(words_of(sentence), longest, _AT))
    return next((names[name] for name in said if name in names), None)


def is_stop_before_name(sentence: str) -> bool:
    """Whether a sentence says a word that stops, and then one word that may be a name.

    >>> [is_stop_before_name(said) for said in ("Stop, river!", "halt big-mule, please")]
    [True, True]
    >>> [is_stop_before_name(said) for said in ("stop recording", "stop the lamp", "halt 3")]
    [False, False, False]
    """
    return any(
        not (word in _NO_NAME_BEHIND or word.endswith("ing") or word.isdecimal())
        for (word,) in _behind(words_of(sentence), 1, _POINTING)
    )


def _behind(
    words: tuple[str, ...], longest: int, never_after: frozenset[str]
) -> Iterator[tuple[str, ...]]:
    """What may be a name behind a word that stops, where nothing else is said."""
    if len(words) > _LONGEST_CALL or _stops(words):
        return
    for start in range(1, len(words)):
        if words[start - 1] in never_after:
            continue
        for end in range(start + 1, min(start + longest, len(words)) + 1):
            if _stops(words[:start]) and _stops(words[:start] + words[end:]):
                yield words[start:end]


def _stops(words: tuple[str, ...]) -> bool:
    left, is_said = words, False
    while left:
        order = next((one for one in _ORDERS if left[: len(one)] == one), None)
        if order is None and left[0] not in _BESIDE:
            return False
        is_said |= order is not None
        left = left[len(order) if order else 1 :]
    return is_said
