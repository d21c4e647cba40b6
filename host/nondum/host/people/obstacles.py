"""Why not: what keeps the robot from what it was asked for, or from a wish. Pure, made of views."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from nondum.host.people.answers import Row, asked_for, fitting, of_the_robot, pursued, wish_lacks

_WAITING = ("suspended", "queued", "kept")


def obstacle(given: Sequence[Row]) -> str:
    """What keeps a robot from the goals that it was given, the most wanted first.

    >>> image = {"code": "WHY_NO_OBJECT", "types": ["image"], "fact": "", "said": "no image"}
    >>> goal = {"text": "follow me", "state": "suspended", "reason": "", "needs": [image]}
    >>> obstacle([goal])
    'I was asked to follow you, but for that I need an image.'
    >>> obstacle([])
    'Nothing keeps me from what I was asked for.'
    """
    waiting = [goal for state in _WAITING for goal in given if goal["state"] == state]
    if waiting and waiting[0]["state"] == "suspended":
        return fitting(pursued(waiting[0], ()))
    if waiting:
        return fitting(_with_reason(f"{asked_for(waiting[0])}, but not yet", waiting[0]))
    if given and all(goal["state"] == "halted" for goal in given):
        return fitting(_with_reason(f"{asked_for(given[-1])}, and ended it", given[-1]))
    at_it = [goal for goal in given if goal["state"] == "active" and not goal["holds"]]
    if at_it:
        return fitting(pursued(at_it[0], ()))
    return "Nothing keeps me from what I was asked for."


def _with_reason(told: str, goal: Row) -> Iterator[str]:
    """What became of a goal, with the reason where that is short enough."""
    if goal["reason"]:
        yield f"{told}: {goal['reason']}"
    yield told


def wish_obstacle(row: Row) -> str:
    """What keeps a robot from one wish; `row` is that of `offers`.

    >>> wish_obstacle({"words": "follow me", "goal": "a", "now": "can", "needs": []})
    'I can follow you: ask me to.'
    """
    wish = of_the_robot(row["words"])
    match row["now"]:
        case "holds":
            return fitting([f"I do: {wish}"])
        case "can":
            return fitting([f"I can {wish}: ask me to"])
        case "cannot":
            told = wish_lacks(row)
            return fitting([f"{told[:1].upper()}{told[1:]}"])
    return fitting([f"I do not know whether I can {wish}"])
