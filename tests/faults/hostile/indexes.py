"""Indexes that say what is no description, or too much."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from tests.faults.hostile.case import INDEX, HostileDrive, spoilt

INVALID, DESCRIPTION = "INDEX_INVALID", "DESCRIPTION_INVALID"
HALF = "\ud83e"
"""Half of a letter beyond the first 65,536: JSON can say it, and no file can hold it."""


def whole(name: str, code: str, data: str | bytes) -> HostileDrive:
    return spoilt(name, code, lambda made: made.with_file(INDEX, data))


def said(name: str, code: str, change: Callable[[dict[str, Any]], Any]) -> HostileDrive:
    """The component says something else."""

    def changed(index: dict[str, Any]) -> dict[str, Any]:
        (component,) = index["components"]
        return {"format": 1, "components": {component: change(index["components"][component])}}

    return spoilt(name, code, lambda made: made.with_index(changed))


def many(name: str, key: str, item: Any) -> HostileDrive:
    return said(name, DESCRIPTION, lambda good: {**good, key: [item] * 3})


DRIVES: tuple[HostileDrive, ...] = (
    whole("index-empty", INVALID, ""),
    whole("index-binary", INVALID, bytes(range(128, 256))),
    whole("index-cut", INVALID, '{"format": 1, "comp'),
    whole("index-a-list", INVALID, "[]"),
    whole("index-a-number", INVALID, "1"),
    whole("index-of-tomorrow", INVALID, '{"format": 99, "components": {}}'),
    whole("index-without-components", INVALID, '{"format": 1}'),
    whole("index-components-a-list", INVALID, '{"format": 1, "components": []}'),
    whole("index-of-no-component", INVALID, '{"format": 1, "components": {}}'),
    whole("index-bomb-of-brackets", INVALID, "[" * 1_000_000),
    whole("index-bomb-of-braces", INVALID, '{"a":' * 500_000),
    whole("index-bomb-of-digits", INVALID, "9" * 1_000_000),
    whole("index-bomb-of-tables", INVALID, "[" + ",".join(['{"a":0}'] * 520_000) + "]"),
    whole("index-a-byte-too-long", "TOO_LARGE", " " * (4 * 2**20 + 1)),
    spoilt(
        "index-of-another",
        INVALID,
        lambda made: made.edited(INDEX, f'"{made.component}": {{', '"other": {'),
    ),
    said("says-nothing", DESCRIPTION, lambda good: {}),
    said("says-a-list", DESCRIPTION, lambda good: [good]),
    said("says-a-word", DESCRIPTION, lambda good: "everything"),
    said("says-null", DESCRIPTION, lambda good: None),
    said("name-a-number", DESCRIPTION, lambda good: {**good, "name": 7}),
    said("behaviours-a-word", DESCRIPTION, lambda good: {**good, "behaviours": "all"}),
    said("unknown-words", DESCRIPTION, lambda good: {**good, "sudo": True}),
    many("behaviours-of-numbers", "behaviours", 7),
    many("fragments-of-null", "fragments", None),
    many("units-of-lists", "units", []),
    many("phrases-of-nothing", "phrases", {}),
    many("streams-of-words", "streams", "video"),
    said("name-half-a-letter", INVALID, lambda good: {**good, "name": HALF}),
    said("word-half-a-letter", INVALID, lambda good: {**good, HALF: True}),
    said("version-half-a-letter", INVALID, lambda good: {**good, "version": f"1.0{HALF}"}),
    said("version-no-number", DESCRIPTION, lambda good: {**good, "version": float("nan")}),
    said(
        "unit-half-a-letter",
        INVALID,
        lambda good: {**good, "units": [{"name": HALF, "type": "lamp"}]},
    ),
    spoilt(
        "component-half-a-letter",
        INVALID,
        lambda made: made.with_index(
            lambda index: {**index, "components": {**index["components"], HALF: {}}}
        ),
    ),
    said(
        "nested-deep",
        DESCRIPTION,
        lambda good: {**good, "units": json.loads("[" * 400 + "]" * 400)},
    ),
)
