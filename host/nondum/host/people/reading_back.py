"""What was understood is read back before it is done: what the robot would do, with what. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.mind.preview import Preview
from nondum.host.people.answers import few, fitting, need_in_words, of_the_robot

_MOST = 4
"""Components, and steps, that are named."""


def read_back(wish: str, preview: Preview) -> str:
    """What the robot would do; `wish` is what it understood, in words or in PDDL.

    >>> read_back("follow me", Preview("can", ("eye.look", "base.go"), ("eye@mule", "base")))
    "I would follow you, with mule's eye and base: eye.look, then base.go."
    >>> read_back("follow me", Preview("holds"))
    'I do that already: follow you.'
    """
    said = wish if wish.startswith("(") else of_the_robot(wish)
    make = f"see to {said}" if wish.startswith("(") else said
    match preview.now:
        case "can":
            return fitting(_would(make, preview))
        case "holds":
            return fitting([f"I do that already: {said}"])
        case "cannot":
            needs = filter(None, (need_in_words(need.to_dict()) for need in preview.needs))
            why = next((f": for that I need {need}" for need in needs), "")
            return fitting([f"I cannot {make} now{why}", f"I cannot {make} now"])
    return fitting([f"I do not know yet whether I can {make}"])


def _would(make: str, preview: Preview) -> Iterator[str]:
    """Shorter and shorter."""
    each = [_owned(component) for component in preview.components]
    steps = list(preview.steps)
    left = len(steps) - _MOST
    more = [f"{left} more"] if left > 0 else []
    then = ", then ".join([*steps[:_MOST], *more])
    yield f"I would {make}, with {few(each, _MOST)}: {then}"
    yield f"I would {make}, with {few(each, _MOST)}"
    yield f"I would {make}, with {few(each, 1)}"
    yield f"I would {make}"


def _owned(component: str) -> str:
    """A component as people call it.

    >>> _owned("eye@mule"), _owned("eye")
    ("mule's eye", 'eye')
    """
    name, _, host = component.partition("@")
    return f"{host}'s {name}" if host else name
