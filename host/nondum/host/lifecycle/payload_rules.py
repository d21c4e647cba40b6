"""How a payload goes through the table of transitions, and what it leaves in the state."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from nondum.host.catalogue.records import MountPose, PayloadRecord, Step
from nondum.host.catalogue.state import Highwater
from nondum.host.effects import (
    ClearPayload,
    CopyPayload,
    PayloadEffect,
    SuspendPayload,
    VerifyPayload,
)
from nondum.host.events import (
    Event,
    ForgetAsked,
    PayloadActivated,
    PayloadFailed,
    PayloadFound,
    PayloadRefused,
    PayloadSentAway,
    PayloadVerified,
    RetryAsked,
)
from nondum.host.lifecycle import admission
from nondum.host.lifecycle.drive_rules import copy_of, read
from nondum.host.lifecycle.turn import Turn
from nondum.host.transitions import TRANSITIONS, Transition

PHASES = {Step.VERIFIED: "verified", Step.STORED: "installed", Step.ACTIVE: "ready"}
"""The steps whose moments people are shown."""

GUEST_RANK = 1_000_000
"""Ranks of components that were not installed for good begin here."""


def on_payload_found(turn: Turn, event: PayloadFound) -> None:
    """Take in a new payload; one that is here already has one source more."""
    if event.drive not in turn.state.drives:
        return
    known = turn.state.payloads.get(event.payload)
    if known is not None:
        if event.drive not in known.sources:
            turn.events.append(event)
        sources = {**known.sources, event.drive: event.folder}
        turn.put_payload(replace(known, sources=sources))
        return
    new = PayloadRecord(
        key=event.payload,
        digest=event.digest,
        payload_id=event.payload_id,
        version=event.version,
        release=event.release,
        fleet=event.fleet,
        step=Step.GONE,
        sources={event.drive: event.folder},
        phases={"seen": turn.state.drives[event.drive].since},
    )
    problems = (*event.problems, *admission.release_problems(turn.state, event, turn.at))
    enter(turn, new, event, TRANSITIONS[Step.GONE, PayloadFound], with_effect=not problems)
    if problems:
        turn.pending.append(PayloadRefused(event.payload, problems))


def on_payload_verified(turn: Turn, event: PayloadVerified) -> None:
    """Go on, unless another payload brings one of its components."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None or payload.step is not Step.COPIED:
        return
    rivals = admission.rivals(turn.state, event.payload, event.components)
    staying = [rival for rival in rivals if rival.step is not Step.REMOVING]
    if staying:
        problems = tuple(admission.taken(rival, event.components) for rival in staying)
        turn.pending.append(PayloadRefused(event.payload, problems))
    elif rivals:
        turn.put_payload(replace(payload, waits_for=rivals[0].key))
    else:
        on_payload_step(turn, event)


def on_payload_step(turn: Turn, event: Any) -> None:
    """Follow the table. What it has no row for comes from an earlier life and is dropped."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None:
        return
    row = TRANSITIONS.get((payload.step, type(event)))
    if row is not None:
        enter(turn, payload, event, row)


def enter(
    turn: Turn,
    payload: PayloadRecord,
    event: Event,
    row: Transition,
    *,
    with_effect: bool = True,
) -> None:
    """Bring a payload to the step that a row of a table leads to."""
    turn.events.append(event)
    payload = _told(replace(payload, step=row.to, waits_for=""), event)
    if row.to in PHASES:
        payload = replace(payload, phases={**payload.phases, PHASES[row.to]: turn.at})
    turn.put_payload(payload)
    if isinstance(event, PayloadActivated):
        _activate(turn, payload, event)
    else:
        turn.drop_components(payload.key)
    if row.to is Step.GONE:
        _leave(turn, payload)
    if row.effect is not None and with_effect:
        turn.effects.append(effect_for(row.effect, payload))


def _told(payload: PayloadRecord, event: Event) -> PayloadRecord:
    """The payload with what an event says of it."""
    match event:
        case PayloadVerified():
            return replace(payload, components=event.components)
        case PayloadRefused() | PayloadFailed() | PayloadSentAway():
            return replace(payload, problems=event.problems)
        case PayloadActivated():
            return replace(payload, attempts=0)
        case RetryAsked():
            return replace(payload, problems=(), attempts=0)
        case _:
            return payload


def on_forget_asked(turn: Turn, event: ForgetAsked) -> None:
    """Forget a payload that was here."""
    if event.payload in turn.state.former:
        turn.events.append(event)
        turn.forget(event.payload)


def effect_for(kind: type[PayloadEffect], payload: PayloadRecord) -> PayloadEffect:
    """An effect of a row of a table, for one payload."""
    if kind is CopyPayload:
        return copy_of(payload)
    if issubclass(kind, ClearPayload | SuspendPayload):
        return kind(payload.key, payload.components)
    return kind(payload.key)


def _activate(turn: Turn, payload: PayloadRecord, event: PayloadActivated) -> None:
    initial = any(turn.state.drives[d].kind == "installed" for d in payload.sources)
    base = 0 if initial else GUEST_RANK
    ranks = [c.rank for c in turn.state.components.values() if (c.rank >= GUEST_RANK) != initial]
    for offset, component in enumerate(event.components):
        rank = max(ranks, default=base) + 1 + offset
        entered = replace(component, payload_id=payload.payload_id, rank=rank)
        turn.put_component(entered)
    turn.forget(payload.payload_id)
    turn.change(
        mounts={**_by_unit(event.mounts), **turn.state.mounts},
        highwater={
            **turn.state.highwater,
            (payload.fleet, payload.payload_id): Highwater(payload.release, payload.digest),
        },
    )


def _by_unit(mounts: Iterable[MountPose]) -> dict[str, MountPose]:
    return {pose.unit: pose for pose in mounts}


def _leave(turn: Turn, payload: PayloadRecord) -> None:
    """Let in whoever waited for it; if it came back meanwhile, read its drives again."""
    turn.effects.extend(
        VerifyPayload(other.key)
        for other in turn.state.payloads.values()
        if other.waits_for == payload.key
    )
    for name in payload.sources:
        read(turn, turn.state.drives[name])
