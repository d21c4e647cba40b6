"""The names that are an author's own, as far as planning knows them: all but the core's."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from itertools import chain
from typing import Any

from demo.shuffle import pddl
from demo.shuffle.pddl import Named, Part

_ALWAYS = frozenset({(Part.OBJECT, "self"), (Part.TYPE, "object"), (Part.PREDICATE, "total-cost")})


class Core:
    """The words that nondum-core shares; no package may rename them."""

    def __init__(self) -> None:
        text = (
            resources.files("nondum.planning.merge").joinpath("nondum-core.pddl").read_text("utf-8")
        )
        self._names = {(part, token.text) for part, token in pddl.fragment(text)} | _ALWAYS

    def has(self, part: Part, name: str) -> bool:
        """Whether the name, in that part, is the core's."""
        return (part, name) in self._names

    @property
    def words(self) -> frozenset[str]:
        """All its names, whatever their part."""
        return frozenset(name for _, name in self._names)


def spoken(description: dict[str, Any]) -> Iterator[Named]:
    """Every name in the PDDL of a description: fragments, goals, signatures."""
    yield from chain.from_iterable(pddl.fragment(f["text"]) for f in description["fragments"])
    yield from chain.from_iterable(pddl.formula(p["goal"]) for p in description["phrases"])
    yield from chain.from_iterable(pddl.signature(b["action"]) for b in description["behaviours"])


def declared(description: dict[str, Any]) -> Iterator[str]:
    """The names that a description declares outside PDDL: units, slots, devices and so on."""
    for unit in description["units"]:
        yield unit["name"]
        yield from (slot["name"] for slot in (*unit["outputs"], *unit["inputs"]))
    for kind in ("behaviours", "conditions", "devices"):
        yield from (entry["name"] for entry in description[kind])
    yield from (label["object"] for label in description["labels"] if label["object"] != "self")
