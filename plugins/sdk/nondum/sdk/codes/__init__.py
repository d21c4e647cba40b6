"""Every code that a refusal may carry: what it means, and what a person can do about it.

    find("WHEEL_BOMB").remedy

Each is declared once, in the module of its area, whichever package of nondum raises it; a test
compares them with the sources. They are imported only when a problem is shown to a person.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import import_module

from nondum.sdk.codes.code import Code
from nondum.sdk.codes.former import FORMER

AREAS = (
    "drives",
    "payloads",
    "trust",
    "wheels",
    "installing",
    "confinement",
    "workers",
    "messages",
    "peers",
    "pairing",
    "host",
    "stopping",
    "feedback",
    "goals",
    "reasons",
    "pddl",
)
"""The modules, in the order in which people are shown them."""

__all__ = ["AREAS", "Code", "areas", "every", "find", "remedy"]


@cache
def areas() -> Mapping[str, tuple[Code, ...]]:
    """The codes of each area, by its name for people."""
    modules = (import_module(f"nondum.sdk.codes.{name}") for name in AREAS)
    return {module.AREA: module.CODES for module in modules}


@cache
def every() -> Mapping[str, Code]:
    """Every code by its name."""
    return {code.name: code for codes in areas().values() for code in codes}


def find(name: str) -> Code | None:
    """The declaration of a code, also by its former name; None when no area declares it.

    >>> find("DISK_FULL").meaning
    'There is too little disk.'
    >>> find("E-TYPE").name
    'PDDL_TYPE'
    """
    return every().get(FORMER.get(name, name))


def remedy(name: str) -> str:
    """What a problem of a code tells to do when it says nothing itself; may be empty."""
    code = find(name)
    return code.remedy if code and code.is_told else ""
