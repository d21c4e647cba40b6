"""Whole names of units and streams in a text, and short ones: which they are, the mind knows."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

_WHOLE = re.compile(r"\w[\w.-]*__[\w.-]*\w")
_WORD = re.compile(r"[^\s()]+")


def shortened(text: str, names: Mapping[str, str]) -> str:
    """A text with short names; `names` are whole name → short one.

    >>> shortened("(ready rover__eye__camera), not x__y", {"rover__eye__camera": "camera"})
    '(ready camera), not x__y'
    """
    return _WHOLE.sub(lambda found: names.get(found[0], found[0]), text)


def whole(text: str, names: Mapping[str, str]) -> str:
    """The same text with whole names again, each word for itself.

    >>> whole("(ready camera)", {"rover__eye__camera": "camera"})
    '(ready rover__eye__camera)'
    """
    found = {short: name for name, short in names.items()}
    return _WORD.sub(lambda word: found.get(word[0], word[0]), text)


def has_unknown(value: Any, names: Mapping[str, str]) -> bool:
    """Whether plain data speak of a unit or stream that has no short name among these.

    >>> has_unknown(["rover__eye__camera"], {}), has_unknown("a", {})
    (True, False)
    """
    return any(name not in names for name in _WHOLE.findall(repr(value)))


def all_shortened(value: Any, names: Mapping[str, str]) -> Any:
    """Plain data with short names in all of its texts; keys stay.

    >>> all_shortened({"a": ["rover__eye__camera", 1]}, {"rover__eye__camera": "camera"})
    {'a': ['camera', 1]}
    """
    match value:
        case str():
            return shortened(value, names)
        case list():
            return [all_shortened(item, names) for item in value]
        case dict():
            return {key: all_shortened(item, names) for key, item in value.items()}
        case _:
            return value
