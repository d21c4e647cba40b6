"""Compares what a payload's index says of a plugin with what the plugin says of itself. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice, zip_longest
from typing import Any

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem

SHOWN = 5
"""Differences that are told; more do not help."""
_NOTHING = object()


def mismatches(
    index: PluginDescription, said: PluginDescription, where: str
) -> tuple[Problem, ...]:
    """The first differences as problems (INDEX_MISMATCH); none when both say the same."""
    differences = islice(_differences(index.to_dict(), said.to_dict(), "index"), SHOWN)
    return tuple(
        Problem(
            "INDEX_MISMATCH",
            f"the plugin does not say what the payload's index says it would: {place}",
            where=where,
            need=_shown(indexed),
            have=_shown(live),
            fix="build the payload again from the plugin that it carries",
        )
        for place, indexed, live in differences
    )


def _differences(index: Any, said: Any, place: str) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(index, Mapping) and isinstance(said, Mapping):
        for key in sorted(index.keys() | said.keys()):
            yield from _differences(
                index.get(key, _NOTHING), said.get(key, _NOTHING), f"{place}.{key}"
            )
    elif isinstance(index, list) and isinstance(said, list):
        pairs = zip_longest(index, said, fillvalue=_NOTHING)
        for number, (one, other) in enumerate(pairs):
            yield from _differences(one, other, f"{place}[{number}]")
    elif index != said:
        yield place, index, said


def _shown(value: Any) -> str:
    if value is _NOTHING:
        return "nothing"
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
