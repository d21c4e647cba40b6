"""Contributions from a few lines of PDDL."""

from __future__ import annotations

from nondum.planning.merge.contribution import Contribution, StreamObject, UnitObject
from nondum.sdk.description import Behaviour, Fragment

HOST = "rover"


def domain(name: str, body: str) -> Fragment:
    """A domain fragment; its first line is the body's first."""
    return Fragment("domain.pddl", f"(define (domain {name}) {body})")


def problem(name: str, body: str) -> Fragment:
    """A problem fragment."""
    return Fragment("problem.pddl", f"(define (problem {name}) {body})")


def brings(
    plugin: str,
    body: str = "",
    init: str = "",
    *,
    rank: int = 0,
    host: str = HOST,
    component: str = "",
    version: str = "1.0",
    units: dict[str, str] | None = None,
    slots: dict[str, str] | None = None,
    behaviours: tuple[Behaviour, ...] | None = None,
) -> Contribution:
    """A component, named as its plugin unless told otherwise, with a domain and a problem."""
    name = component or plugin
    owned = {local: f"{host}__{name}__{local}" for local in (*(units or {}), *(slots or {}))}
    first_unit = next(iter(owned.values()), "")
    return Contribution(
        component=name,
        host=host,
        plugin=plugin,
        version=version,
        rank=rank,
        fragments=(
            *([domain(plugin, body)] if body else []),
            *([problem(plugin, init)] if init else []),
        ),
        units=tuple(UnitObject(u, owned[u], type_) for u, type_ in (units or {}).items()),
        streams=tuple(
            StreamObject(s, owned[s], type_, first_unit) for s, type_ in (slots or {}).items()
        ),
        behaviours=behaviours,
    )
