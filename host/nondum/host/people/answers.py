"""Answers to what people ask a robot, in one sentence that can be spoken. Pure, made of views."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

from nondum.planning.explain.cause import Lack
from nondum.planning.pddl.facts import parts
from nondum.planning.words.pattern import as_said

Row = Mapping[str, Any]

LONGEST = 160
"""Characters of an answer; what is longer is for reading."""

_LENGTHS = ((6, 2), (5, 1), (4, 1), (3, 1), (2, 1), (1, 1), (3, 0), (2, 0), (1, 0))
"""How many abilities and how many missing things an answer names: pairs, the longest first."""
_NOTHING = "I can do nothing yet"


def abilities(can: Sequence[Row], coming: int = 0, waiting: Sequence[str] = ()) -> str:
    """What the robot can do, and what it lacks for more; `can` are the rows of `offers`, `coming`
    is how many payloads are being installed, `waiting` says which component waits for what.

    >>> pointer = {"code": "WHY_NO_OBJECT", "types": ["pointer"], "fact": "", "waits": False}
    >>> can = [
    ...     {"words": "follow me", "goal": "a", "now": "can", "needs": []},
    ...     {"words": "look for me", "goal": "b", "now": "can", "needs": []},
    ...     {"words": "point at the source", "goal": "c", "now": "cannot", "needs": [pointer]},
    ... ]
    >>> abilities(can)
    'I can follow you and look for you; to point at the source I need a pointer.'
    >>> abilities([], coming=2)
    'I can do nothing yet: 2 payloads are being installed.'
    >>> abilities([], waiting=["turret waits for its device head (then it can point)"])
    'I can do nothing now: turret waits for its device head (then it can point).'
    """
    able = _words(row for row in can if row["now"] in ("can", "holds"))
    lacking = [*waiting, *_lacking(row for row in can if row["now"] == "cannot")]
    if not able and (coming or not lacking):
        return f"{_NOTHING}: {_coming(coming) or 'nothing is plugged in that knows words'}."
    end = f"; {_coming(coming)}" if coming else ""
    told = (_abilities(able, lacking, most, more) for most, more in _LENGTHS)
    return fitting(f"{words}{end}" for words in told if words)


def activity(
    given: Sequence[Row], steps: Sequence[Row], lent: Collection[str] = (), coming: int = 0
) -> str:
    """What the robot does: `given` are the goals, `steps` those of the plan that is carried out,
    `lent` the components that run for other hosts.

    >>> goal = {"text": "follow me", "state": "active", "holds": True, "reason": "", "needs": []}
    >>> activity([goal], [{"component": "base", "state": "established"}])
    'I was asked to follow you, and I do, with base.'
    >>> image = {"code": "WHY_NO_OBJECT", "types": ["image"], "fact": "", "said": "no image"}
    >>> activity([{**goal, "state": "suspended", "needs": [image]}], [])
    'I was asked to follow you, but for that I need an image.'
    >>> activity([], [])
    'I do nothing: no one has asked for anything.'
    """
    open_goals = [goal for goal in given if goal["state"] in _URGENCY]
    first = min(open_goals, key=lambda goal: _URGENCY.index(goal["state"]), default=None)
    lent_out = f"{listed(sorted(lent))} {_run(lent)} for another host" if lent else ""
    more = len(open_goals) - 1
    beside = [lent_out, _coming(coming), f"{_goals(more)} waiting" if more > 0 else ""]
    ends = "".join(f"; {words}" for words in beside if words)
    if first is None:
        why = lent_out or _coming(coming) or "no one has asked for anything"
        return f"I do nothing{' of my own' if lent_out else ''}: {why}."
    return fitting(f"{words}{end}" for end in (ends, "") for words in pursued(first, steps))


_URGENCY = ("active", "queued", "suspended")


def _abilities(able: Sequence[str], lacking: Sequence[str], most: int, more: int) -> str:
    if not able:
        return f"I can do nothing now: {'; '.join(lacking[:more])}" if more else ""
    if not most:
        return ""
    return "; ".join([f"I can {few(able, most)}", *lacking[:more]])


def few(words: Sequence[str], most: int) -> str:
    """The first words, and how many more there are."""
    left = len(words) - most
    more = [f"{left} thing{'s' if left > 1 else ''} more"] if left > 0 else []
    return listed([*words[:most], *more])


def _words(rows: Iterable[Row]) -> list[str]:
    """One sentence a goal, the shortest; free words are left out."""
    found: dict[str, str] = {}
    for row in rows:
        words = of_the_robot(re.sub(r"\s*<[^>]*>", "", row["words"]))
        if row["goal"] not in found or len(words) < len(found[row["goal"]]):
            found[row["goal"]] = words
    return list(found.values())


def _lacking(rows: Iterable[Row]) -> list[str]:
    """What is missing for what; what could be said at once comes first."""
    concrete = sorted(rows, key=lambda row: "{" in row["words"])
    wanted: dict[str, dict[str, str]] = {}
    for row in concrete:
        if any(need["waits"] for need in row["needs"]):  # that is said of the component
            continue
        need = next(filter(None, map(need_in_words, row["needs"])), "")
        wanted.setdefault(need, {}).setdefault(row["goal"], of_the_robot(as_said(row["words"])))
    return [
        f"to {few(list(words.values()), 2)} I need {need}"
        if need
        else f"I cannot {few(list(words.values()), 2)} now"
        for need, words in wanted.items()
    ]


def wish_lacks(row: Row) -> str:
    """What is missing for one row of `offers`.

    >>> wish_lacks({"words": "follow me", "goal": "a", "needs": []})
    'I cannot follow you now'
    """
    return next(iter(_lacking([row])), f"I cannot {of_the_robot(as_said(row['words']))} now")


def need_in_words(need: Row) -> str:
    """What is missing, by a row of `Need`; empty where that cannot be said shortly.

    >>> need_in_words({"code": "WHY_NO_OBJECT", "types": ["image", "class"], "fact": ""})
    'an image or a class'
    >>> need_in_words({"code": "WHY_NOT_SO", "types": [], "fact": "ready rover__turret__head"})
    'the head to be ready'
    """
    predicate, arguments = parts(need["fact"])
    match need["code"]:
        case Lack.OBJECT.value:
            return " or ".join(map(_a, need["types"]))
        case Lack.HOST.value if predicate == "ready" and not arguments[0].startswith("?"):
            return f"the {_short(arguments[0])} to be ready"
    return ""


def asked_for(goal: Row) -> str:
    """What a person asked for, in words or in PDDL.

    >>> asked_for({"text": "follow me"}), asked_for({"text": "(lit rover)"})
    ('I was asked to follow you', 'I was asked for (lit rover)')
    """
    text = goal["text"]
    return f"I was asked for {text}" if "(" in text else f"I was asked to {of_the_robot(text)}"


def pursued(goal: Row, steps: Sequence[Row]) -> Iterator[str]:
    """What becomes of a goal, shorter and shorter."""
    head = asked_for(goal)
    first = next(iter(goal["needs"]), None)
    why = _in_short_names(str(first["said"] if first else goal["reason"]))
    running = [row["component"] for row in steps if row["component"]]
    names = listed(list(dict.fromkeys(name.split("@")[0] for name in running)))
    if goal["state"] == "suspended":
        if need := first and need_in_words(first):
            yield f"{head}, but for that I need {need}"
        yield f"{head}, but I cannot now{f': {why}' if why else ''}"
        yield f"{head}, but I cannot now"
    elif goal["state"] == "queued":
        yield f"{head}, and look for a way"
    else:
        done = sum(row["state"] == "done" for row in steps)
        how = "and I do" if goal["holds"] else "and am at it"
        count = f" ({done} of {len(steps)} steps done)" if done and not goal["holds"] else ""
        if names:
            yield f"{head}, {how}, with {names}{count}"
        yield f"{head}, {how}{count}"
        yield f"{head}, {how}"


def _in_short_names(text: str) -> str:
    return re.sub(r"[\w-]+__[\w-]+", lambda name: _short(name[0]), text)


def _short(name: str) -> str:
    return name.rpartition("__")[2]


def _a(noun: str) -> str:
    return f"{'an' if noun[:1] in 'aeiou' else 'a'} {noun}"


def _coming(count: int) -> str:
    if not count:
        return ""
    return "a payload is being installed" if count == 1 else f"{count} payloads are being installed"


def _goals(count: int) -> str:
    return f"{count} more goal{'s are' if count > 1 else ' is'}"


def _run(names: Collection[str]) -> str:
    return "runs" if len(names) == 1 else "run"


def fitting(told: Iterable[str]) -> str:
    """The first that is short enough to be spoken, as a sentence; else the last, cut."""
    sentences = [f"{words}." for words in told]
    last = sentences[-1]
    cut = last if len(last) <= LONGEST else f"{last[: LONGEST - 1]}…"
    return next((one for one in sentences if len(one) <= LONGEST), cut)


def of_the_robot(words: str) -> str:
    """What a person asks for, as the robot says it: who speaks is somebody else.

    >>> of_the_robot("follow me to my car")
    'follow you to your car'
    >>> of_the_robot("please follow me")
    'follow you'
    """
    said = (_PERSONS.get(word.casefold(), word) for word in words.split())
    return " ".join(word for word in said if word.casefold().strip(",") != "please")


_PERSONS = {
    **dict.fromkeys(("me", "i", "us", "we"), "you"),
    **dict.fromkeys(("my", "our"), "your"),
    **dict.fromkeys(("mine", "ours"), "yours"),
    **dict.fromkeys(("myself", "ourselves"), "yourself"),
    **{"you": "me", "your": "my", "yours": "mine", "yourself": "myself"},
}


def listed(words: Sequence[str]) -> str:
    """Words in a sentence.

    >>> listed(["follow you", "look for you", "stop"])
    'follow you, look for you and stop'
    """
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))
