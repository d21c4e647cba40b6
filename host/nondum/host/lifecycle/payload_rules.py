"""How a payload goes through the table of transitions, and what it leaves in the state."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from nondum.host.core.effects import (
    ActivatePayload,
    AttachDevice,
    ClearPayload,
    CopyPayload,
    JudgePayloads,
    PayloadEffect,
    ProbeComponents,
    RestPayload,
    StoreWheels,
    SuspendPayload,
)
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    ForgetAsked,
    PayloadActivated,
    PayloadFailed,
    PayloadFound,
    PayloadRefused,
    PayloadVerified,
    PayloadWithdrawn,
    RetryAsked,
    WheelsStored,
)
from nondum.host.core.events.placement import PayloadSentAway
from nondum.host.core.events.releases import PayloadResumed, PayloadSuperseded, RollbackAsked
from nondum.host.core.events.trust import PayloadDistrusted, PayloadDoubted, TrustChanged
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.core.transitions import TRANSITIONS, Transition
from nondum.host.lifecycle import (
    admission,
    component_names,
    crash_attribution,
    releases,
    replacement,
    retry_causes,
    safe_mode,
)
from nondum.host.lifecycle.device_allocation import granted
from nondum.host.lifecycle.drive_rules import copy_of, drop_replaced, drop_rewritten, read
from nondum.host.lifecycle.turn import Turn

PHASES = {Step.VERIFIED: "verified", Step.STORED: "installed", Step.ACTIVE: "ready"}
"""The steps whose moments people are shown."""

_KEPT = frozenset({Step.STAGED, Step.STORED, Step.PROBED, Step.ACTIVE, Step.SUPERSEDED})

GUEST_RANK = 1_000_000
"""Ranks of components that were not installed for good begin here."""


def on_payload_found(turn: Turn, event: PayloadFound) -> None:
    """Take in a new payload; one that is here already has one source more. One that was refused for
    its signatures, and would not be any more, is tried again."""
    if event.drive not in turn.state.drives:
        return
    known = turn.state.payloads.get(event.payload)
    if known is not None:
        if event.drive not in known.sources:
            turn.events.append(event)
        sources = {**known.sources, event.drive: event.folder}
        turn.put_payload(replace(known, sources=sources))
        is_refused = known.step is Step.REFUSED and retry_causes.is_unsigned(known.problems)
        if is_refused and not event.problems:
            turn.pending.append(RetryAsked(event.payload, "it has been signed since"))
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
    releases.on_found(turn, event)
    drop_rewritten(turn, event)
    problems = (
        *event.problems,
        *admission.release_problems(turn.state, event, turn.at),
        *crash_attribution.payload_problems(turn.state, event),
        *safe_mode.drive_problems(
            turn.state, turn.state.drives[event.drive].kind, event.payload_id
        ),
    )
    enter(turn, new, event, TRANSITIONS[Step.GONE, PayloadFound], with_effect=not problems)
    if problems:
        turn.pending.append(PayloadRefused(event.payload, problems))


def on_payload_verified(turn: Turn, event: PayloadVerified) -> None:
    """Name its components and go on, unless it would replace a release that can be planned with by
    one that cannot."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None or payload.step is not Step.COPIED:
        return
    payload = component_names.named(turn.state, payload, event.components)
    said = {payload.names[id]: description for id, description in event.index.items()}
    index = component_names.as_called(turn.state, payload.payload_id, said)
    if worse := replacement.problems(turn.state, payload, index):
        turn.pending.append(PayloadRefused(event.payload, worse))
    else:
        turn.put_payload(payload)
        on_payload_step(turn, event)


def on_wheels_stored(turn: Turn, event: WheelsStored) -> None:
    """Bring it to life, unless another release of it is active or comes first."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None or payload.step is not Step.STAGED:
        return
    other = releases.waits_behind(turn.state, payload)
    row = TRANSITIONS[Step.STAGED, WheelsStored]
    enter(turn, payload, event, row, with_effect=other is None)
    if other is not None:
        turn.pending.append(releases.waiting(payload, other))


def on_payload_activated(turn: Turn, event: PayloadActivated) -> None:
    """Enter its components, unless a release that can be planned with would give way to it: what
    is here may have changed since it was verified."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None or payload.step is not Step.PROBED:
        return
    said = {component.id: component.description for component in event.components}
    index = component_names.as_called(turn.state, payload.payload_id, said)
    if worse := replacement.problems(turn.state, payload, index):
        turn.pending.append(PayloadFailed(event.payload, worse))
    else:
        called = (replace(c, description=index[c.id]) for c in event.components)
        on_payload_step(turn, replace(event, components=tuple(called)))


def on_payload_tried(turn: Turn, event: RetryAsked) -> None:
    """Try a refused or quarantined payload again, once other releases of it are out of the way."""
    payload = turn.state.payloads.get(event.payload)
    row = TRANSITIONS.get((payload.step, RetryAsked)) if payload is not None else None
    if payload is None or row is None:
        return
    starts = row.to is Step.STORED
    other = releases.waits_behind(turn.state, payload) if starts else None
    enter(turn, payload, event, row, with_effect=other is None)
    if other is not None:
        turn.pending.append(releases.waiting(payload, other))


def on_rollback_asked(turn: Turn, event: RollbackAsked) -> None:
    """Go back to an earlier release; one that was refused for being older is read again."""
    if releases.on_rollback_asked(turn, event):
        on_payload_step(turn, event)


def on_payload_step(turn: Turn, event: Any) -> None:
    """Follow the table. What it has no row for comes from an earlier life and is dropped."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None:
        return
    row = TRANSITIONS.get((payload.step, type(event)))
    if row is not None:
        enter(turn, payload, _foretold(turn.state, payload, event), row)


def _foretold(state: HostState, payload: PayloadRecord, event: Any) -> Any:
    """A refusal, with whether it is tried again. What was to be installed for good is not: it is
    given up."""
    if isinstance(event, PayloadRefused | PayloadFailed) and not crash_attribution.is_initial(
        state, payload
    ):
        return replace(event, problems=retry_causes.foretold(event.problems, payload.payload_id))
    return event


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
    effect = effect_for(row.effect, payload, turn.state) if row.effect and with_effect else None
    payload = _told(replace(payload, step=row.to), event)
    if row.to in PHASES:
        payload = replace(payload, phases={**payload.phases, PHASES[row.to]: turn.at})
    turn.put_payload(payload)
    if isinstance(event, PayloadActivated):
        _activate(turn, payload, event)
    else:
        turn.drop_components(payload.key)
    if isinstance(event, PayloadWithdrawn):
        releases.on_withdrawn(turn, payload)
    if row.to is Step.GONE:
        _leave(turn, payload)
    if effect is not None:
        turn.effects.append(effect)


def _told(payload: PayloadRecord, event: Event) -> PayloadRecord:
    """The payload with what an event says of it."""
    match event:
        case PayloadRefused() | PayloadFailed() | PayloadSentAway() | PayloadDistrusted():
            return replace(payload, problems=event.problems)
        case RetryAsked():
            return replace(payload, problems=())
        case PayloadSuperseded() | PayloadResumed():
            return replace(payload, was=0)
        case _:
            return payload


def on_trust_changed(turn: Turn, event: TrustChanged) -> None:
    """Check again whether the payloads that are here are trusted."""
    turn.events.append(event)
    turn.effects.append(JudgePayloads(kept(turn.state)))
    turn.pending.extend(
        RetryAsked(payload.key, "the trust of this host has changed")
        for payload in turn.state.payloads.values()
        if payload.step is Step.REFUSED and retry_causes.is_untrusted(payload.problems)
    )


def on_payload_doubted(turn: Turn, event: PayloadDoubted) -> None:
    """Let a payload that is not trusted any more go on, and say so."""
    payload = turn.state.payloads.get(event.payload)
    if payload is not None and payload.problems != event.problems:
        turn.events.append(event)
        turn.put_payload(replace(payload, problems=event.problems))


def kept(state: HostState) -> tuple[str, ...]:
    """Payloads of which what they were judged by lies on this host's disk."""
    return tuple(payload.key for payload in state.payloads.values() if payload.step in _KEPT)


def on_forget_asked(turn: Turn, event: ForgetAsked) -> None:
    """Forget a payload that was here, and what it was called: others may have these names."""
    if event.payload in turn.state.former:
        turn.events.append(event)
        turn.forget(event.payload)
        names = {id: one for id, one in turn.state.names.items() if id != event.payload}
        turn.change(names=names)


def effect_for(
    kind: type[PayloadEffect], payload: PayloadRecord, state: HostState
) -> PayloadEffect:
    """An effect of a row of a table, for one payload."""
    if kind is CopyPayload:
        return copy_of(payload, state)
    if issubclass(kind, ClearPayload | RestPayload | SuspendPayload):
        return kind(payload.key, payload.components)
    if issubclass(kind, StoreWheels | ProbeComponents | ActivatePayload):
        old = releases.active_release(state, payload)
        beside = old.key if old else ""
        if issubclass(kind, ActivatePayload):
            return kind(payload.key, beside)
        return kind(payload.key, beside, renamed=payload.renamed)
    return kind(payload.key)


def _activate(turn: Turn, payload: PayloadRecord, event: PayloadActivated) -> None:
    for component in _entering(turn, payload, event):
        turn.put_component(replace(component, payload_id=payload.payload_id))
    drop_replaced(turn, payload)
    turn.forget(payload.payload_id)
    brought = (replace(data, payload_id=payload.payload_id) for data in event.data)
    turn.change(
        mounts={**_by_unit(event.mounts), **turn.state.mounts},
        data={**turn.state.data, **{data.id: data for data in brought}},
    )
    reached = admission.reached(turn.state, payload, event)
    turn.change(
        highwater={**turn.state.highwater, payload.payload_id: reached},
        names=component_names.remembering(turn.state, payload, event.components),
    )


def _entering(
    turn: Turn, payload: PayloadRecord, event: PayloadActivated
) -> Iterator[ComponentRecord]:
    """The components with their ranks. Those of a release that it takes over from are withdrawn,
    and leave them their ranks and devices."""
    new = event.components
    old = releases.active_release(turn.state, payload)
    if old is not None:
        before = [c for c in turn.state.components.values() if c.payload == old.key]
        turn.put_payload(replace(payload, was=old.release))
        on_payload_step(turn, releases.superseded(old, payload))
        new = releases.inherited(new, before, turn.state.devices)
        for component in new:
            turn.effects.extend(_attached(turn, component))
    initial = any(turn.state.drives[d].kind == "installed" for d in payload.sources)
    base = 0 if initial else GUEST_RANK
    ranks = [c.rank for c in turn.state.components.values() if (c.rank >= GUEST_RANK) != initial]
    next_rank = max(ranks, default=base) + 1
    for component in new:
        if component.rank:
            yield component
        else:
            yield replace(component, rank=next_rank)
            next_rank += 1


def _attached(turn: Turn, component: ComponentRecord) -> Iterator[AttachDevice]:
    for claim in component.devices:
        if claim.device is not None:
            device = turn.state.devices[claim.device]
            yield AttachDevice(component.id, claim.name, granted(device, claim))


def _by_unit(mounts: Iterable[MountPose]) -> dict[str, MountPose]:
    return {pose.unit: pose for pose in mounts}


def _leave(turn: Turn, payload: PayloadRecord) -> None:
    """If it came back meanwhile, read its drives again."""
    for name in payload.sources:
        read(turn, turn.state.drives[name])
