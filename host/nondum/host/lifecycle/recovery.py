"""What a starting daemon makes of the state that the last one left: back before STORED, else on.

The pure half is here; `folders.sweep` deletes what the recovered state does not account for.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from nondum.host.catalogue.records import Moment, PayloadRecord, Step
from nondum.host.catalogue.state import HostState
from nondum.host.effects import SuspendPayload
from nondum.host.events import HostStarted, Recovered
from nondum.host.lifecycle import releases, tries
from nondum.host.lifecycle.advance import follow_all
from nondum.host.lifecycle.folders import KEEPS_FOLDER
from nondum.host.lifecycle.payload_rules import effect_for
from nondum.host.lifecycle.turn import Outcome, Turn
from nondum.host.transitions import RECOVERY, Transition
from nondum.sdk.errors import Problem


def recover(state: HostState, at: Moment, missing: Set[str] = frozenset()) -> Outcome:
    """Send every payload forward or back. Devices and drives are told anew by their sources.

    `missing` are keys of payloads whose folders are not there any more.
    """
    turn = Turn(state, at)
    turn.change(devices={}, tries=tries.counted(state), is_stopped=False)
    for payload in state.payloads.values():
        turn.drop_components(payload.key)
        _recover(turn, payload, state, is_missing=payload.key in missing)
    used = {name for payload in turn.state.payloads.values() for name in payload.sources}
    kept = {id: drive for id, drive in turn.state.drives.items() if id in used}
    turn.change(drives=kept, revision=state.revision + 1)
    recovered = tuple(event.payload for event in turn.events if isinstance(event, Recovered))
    turn.events.append(HostStarted(state.host, recovered))
    follow_all(turn)
    return turn.outcome()


def _recover(turn: Turn, payload: PayloadRecord, found: HostState, *, is_missing: bool) -> None:
    row, problems = _row(turn.state, payload, found, is_missing=is_missing), payload.problems
    if row.to is Step.QUARANTINED and payload.step is not Step.QUARANTINED:
        problems = (_lost(payload) if is_missing else tries.left_alone(payload.payload_id),)
    if row.effect is not None:
        turn.effects.append(effect_for(row.effect, payload, turn.state))
    turn.put_payload(replace(payload, step=row.to, waits_for="", problems=problems))
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
        return Transition(Step.QUARANTINED if tries.is_initial(state, payload) else Step.GONE)
    if row.to is Step.STORED and tries.is_left_alone(state, payload.key):
        return Transition(Step.QUARANTINED, SuspendPayload)
    if row.to is Step.STORED and releases.waits_for_recovery(found, payload):
        return RECOVERY[Step.SUPERSEDED]
    return row


def _lost(payload: PayloadRecord) -> Problem:
    return Problem(
        "PAYLOAD_LOST",
        "its files are gone from this host's state folder",
        where=payload.payload_id,
        fix=f"`nondum payload uninstall {payload.payload_id}`, then install it again",
    )
