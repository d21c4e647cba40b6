"""What a starting daemon makes of the state that the last one left: back before STORED, else on.

The pure half is here; `folders.sweep` deletes what the recovered state does not account for.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from nondum.host.core.effects import SuspendPayload
from nondum.host.core.events.daemon import HostStarted, SafeModeEntered
from nondum.host.core.events.payloads import Recovered
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.safety import Safety
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.core.transitions import KEEPS_FOLDER, RECOVERY, Transition
from nondum.host.lifecycle import crash_attribution, releases, safe_mode
from nondum.host.lifecycle.advance import follow_all
from nondum.host.lifecycle.payload_rules import effect_for
from nondum.host.lifecycle.turn import Outcome, Turn
from nondum.sdk.errors import Problem


def recover(
    state: HostState,
    at: Moment,
    missing: Set[str] = frozenset(),
    safety: Safety = Safety.OFF,
    why: str = "",
) -> Outcome:
    """Send every payload forward or back. The sources report devices and drives again.

    `missing` are keys of payloads whose files are not there any more; `why` it is safe mode.
    """
    turn = Turn(state, at)
    turn.change(devices={}, tries=crash_attribution.counted(state), is_stopped=False, safety=safety)
    state = replace(state, payloads=safe_mode.roused(state, safety))
    for payload in state.payloads.values():
        turn.drop_components(payload.key)
        _recover(turn, payload, state, is_missing=payload.key in missing)
    used = {name for payload in turn.state.payloads.values() for name in payload.sources}
    kept = {id: drive for id, drive in turn.state.drives.items() if id in used}
    turn.change(drives=kept, revision=state.revision + 1)
    recovered = tuple(event.payload for event in turn.events if isinstance(event, Recovered))
    turn.events.append(HostStarted(state.host, recovered))
    if safety is not Safety.OFF:
        turn.events.append(SafeModeEntered(state.host, (safe_mode.problem(safety, why=why),)))
    follow_all(turn)
    return turn.outcome()


def _recover(turn: Turn, payload: PayloadRecord, found: HostState, *, is_missing: bool) -> None:
    row, problems = _row(turn.state, payload, found, is_missing=is_missing), payload.problems
    if row.to is Step.QUARANTINED and payload.step is not Step.QUARANTINED:
        problems = (_why_not(turn.state, payload, is_missing=is_missing),)
    if row.effect is not None:
        turn.effects.append(effect_for(row.effect, payload, turn.state))
    turn.put_payload(replace(payload, step=row.to, problems=problems))
    if row.to is not payload.step or row.to is Step.REMOVING:
        turn.events.append(Recovered(payload.key, payload.step.name))


def _row(
    state: HostState, payload: PayloadRecord, found: HostState, *, is_missing: bool
) -> Transition:
    """Where a payload goes: as the table says, unless its files are gone, daemons died at it, or
    another release of it goes first."""
    row = RECOVERY[payload.step]
    if is_missing and row.to in KEEPS_FOLDER:
        # A guest is found on its drive again; what was installed for good is not, and is told.
        return Transition(
            Step.QUARANTINED if crash_attribution.is_initial(state, payload) else Step.GONE
        )
    if row.to in (Step.STORED, Step.SUPERSEDED) and _is_kept_out(state, payload):
        return Transition(Step.QUARANTINED, SuspendPayload)
    if row.to is Step.STORED and crash_attribution.is_left_alone(state, payload.key):
        return Transition(Step.QUARANTINED, SuspendPayload)
    if row.to is Step.STORED and releases.waits_for_recovery(found, payload):
        return RECOVERY[Step.SUPERSEDED]
    return row


def _is_kept_out(state: HostState, payload: PayloadRecord) -> bool:
    """Whether safe mode leaves it alone."""
    return safe_mode.is_left_alone(
        state.safety, is_initial=crash_attribution.is_initial(state, payload)
    )


def _why_not(state: HostState, payload: PayloadRecord, *, is_missing: bool) -> Problem:
    if is_missing:
        return _lost(payload)
    if _is_kept_out(state, payload):
        return safe_mode.problem(state.safety, payload.payload_id)
    return crash_attribution.left_alone(state, payload.key, payload.payload_id)


def _lost(payload: PayloadRecord) -> Problem:
    return Problem(
        "PAYLOAD_LOST",
        "its files, or its wheels for this host's Python, are gone from this host's state folder",
        where=payload.payload_id,
        fix=f"`nondum payload uninstall {payload.payload_id}`, then install it again",
    )
