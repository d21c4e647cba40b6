"""What happened: the last sentences that people were told, with how long ago that was. Pure."""

from __future__ import annotations

from collections.abc import Iterable

from nondum.host.mind.announcements import Told
from nondum.host.people.answers import LONGEST, fitting

_MINUTE_S, _HOUR_S, _DAY_S = 60, 3600, 86400
_JUST_NOW_S = 10


def recent(told: Iterable[Told], now_s: float) -> str:
    """The newest sentences first, as many as can be spoken; answers are left out, and so is what
    is advised in them. `now_s` is in seconds since 1970.

    >>> recent([Told(1, 0.0, "eye is here"), Told(2, 90.0, "eye is gone: it could look")], 120.0)
    '30 seconds ago: eye is gone: it could look; 2 minutes ago: eye is here.'
    """
    sentence = ""
    for one in sorted(told, key=lambda one: one.number, reverse=True):
        if one.is_answer:
            continue
        text = one.text.split(" \u2192 ")[0]
        longer = "; ".join(filter(None, (sentence, f"{_ago(now_s - one.wall_s)}: {text}")))
        if sentence and len(longer) >= LONGEST:
            break
        sentence = longer
    return fitting([sentence[:1].upper() + sentence[1:]]) if sentence else "Nothing yet."


def _ago(seconds: float) -> str:
    if seconds < _JUST_NOW_S:
        return "just now"
    for unit, size in (("day", _DAY_S), ("hour", _HOUR_S), ("minute", _MINUTE_S), ("second", 1)):
        if seconds >= size:
            count = int(seconds // size)
            return f"{count} {unit}{'s' if count > 1 else ''} ago"
    return "just now"
