"""Whether a payload may come in beside what is, and was, here: releases and components."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.catalogue.records import Moment, PayloadRecord, Step
from nondum.host.catalogue.state import HostState
from nondum.host.events import PayloadFound
from nondum.host.lifecycle import releases
from nondum.sdk.errors import Problem

RELEASE_JUMP = 1_000_000
"""A release this far ahead of both the newest known and the clock (releases may be build times)
would lock out every honest one after it."""

_HOLDS_NOTHING = frozenset({Step.RECEIVED, Step.COPIED, Step.REFUSED, Step.GONE})


def release_problems(state: HostState, found: PayloadFound, at: Moment) -> Iterator[Problem]:
    """What the releases that were active here have against this one."""
    newest = state.highwater.get((found.fleet, found.payload_id))
    if newest is None:
        return
    where = found.payload_id
    limit = max(newest.release, int(at.wall_s)) + RELEASE_JUMP
    if found.release < newest.release and not releases.is_overruled(state, found):
        yield Problem(
            "ROLLBACK",
            "an older release than was active here before",
            where=where,
            need=f"release {newest.release} or newer",
            have=f"release {found.release}",
            fix=f"plug in the newer release, or `nondum payload rollback {where}`",
        )
    elif found.release == newest.release and found.digest != newest.digest:
        yield Problem(
            "RELEASE_CONFLICT",
            f"release {found.release} was active here before, with other content",
            where=where,
            fix="find out which is genuine; a changed payload needs a higher release",
        )
    elif found.release > limit:
        yield Problem(
            "RELEASE_JUMP",
            "the release is implausibly far ahead",
            where=where,
            need=f"at most {limit}",
            have=str(found.release),
            fix="build it again with a plausible --release",
        )


def rivals(state: HostState, payload: str, components: tuple[str, ...]) -> list[PayloadRecord]:
    """Other payloads on this host that bring a component of the same id."""
    return [
        other
        for other in state.payloads.values()
        if other.key != payload
        and other.step not in _HOLDS_NOTHING
        and not _is_same_payload(state, other, payload)
        and set(other.components) & set(components)
    ]


def _is_same_payload(state: HostState, other: PayloadRecord, payload: str) -> bool:
    """Whether it is another release of the same one: one of them is in force at a time."""
    known = state.payloads.get(payload)
    return known is not None and releases.key_of(known) == releases.key_of(other)


def taken(rival: PayloadRecord, components: tuple[str, ...]) -> Problem:
    """The refusal of components that `rival` brought before."""
    shared = ", ".join(sorted(set(rival.components) & set(components)))
    return Problem(
        "COMPONENT_TAKEN",
        f"{rival.payload_id} {rival.version} already brings {shared}",
        where=shared,
        fix=f"pull {rival.payload_id} first",
    )
