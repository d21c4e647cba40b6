"""Facts as text: `predicate object …`, the same in world models, ground tasks and on the wire.

A fact that a plan needs to be false has a twin, `!predicate object …`, that is true when the fact
is not. Only ground tasks know twins; no name in PDDL begins with `!`.
"""

from __future__ import annotations

from collections.abc import Container

_NEGATION = "!"


def fact(predicate: str, *arguments: str) -> str:
    """Write a fact.

    >>> fact("pointing", "rover", "source")
    'pointing rover source'
    """
    return " ".join((predicate, *arguments))


def parts(text: str) -> tuple[str, tuple[str, ...]]:
    """Predicate and arguments of a fact.

    >>> parts("pointing rover source")
    ('pointing', ('rover', 'source'))
    """
    predicate, *arguments = text.split(" ")
    return predicate, tuple(arguments)


def predicate_of(text: str) -> str:
    """The predicate of a fact.

    >>> predicate_of("pointing rover source")
    'pointing'
    """
    return text.partition(" ")[0]


def twin(text: str) -> str:
    """The fact that is true when this one is not; of a twin, the fact itself.

    >>> twin("idle base"), twin("!idle base")
    ('!idle base', 'idle base')
    """
    return text.removeprefix(_NEGATION) if is_twin(text) else _NEGATION + text


def is_twin(text: str) -> bool:
    """Whether this is the negation of a fact (or a predicate name that would be one)."""
    return text.startswith(_NEGATION)


def holds(text: str, believed: Container[str]) -> bool:
    """Whether a fact or twin is true where exactly the facts in `believed` are.

    >>> holds("!idle base", {"on base rover"})
    True
    """
    return (twin(text) not in believed) if is_twin(text) else (text in believed)
