"""The component manager's function: (state, event) → (state, effects, events to journal).

Pure: it reads no clock and touches nothing. News that means nothing any more (of a payload that is
gone, of a component that was withdrawn) gives the same state and no events.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nondum.host.core import events
from nondum.host.core.events import Event
from nondum.host.core.records import Moment
from nondum.host.core.state import HostState
from nondum.host.core.transitions import TRANSITIONS
from nondum.host.lifecycle import (
    component_rules,
    crash_attribution,
    device_allocation,
    drive_rules,
    goal_rules,
    payload_rules,
    peer_rules,
    rebuilding,
    releases,
    retry_rules,
    safe_mode_rules,
)
from nondum.host.lifecycle.turn import Outcome, Turn

_Rule = Callable[[Turn, Any], None]

RULES: Mapping[type[Event], _Rule] = {
    **{event: payload_rules.on_payload_step for _, event in TRANSITIONS},
    events.DriveInserted: drive_rules.on_drive_inserted,
    events.DriveRemoved: drive_rules.on_drive_removed,
    events.DriveRead: drive_rules.on_drive_read,
    events.DriveUnreadable: drive_rules.on_drive_unreadable,
    events.DrivesScanned: drive_rules.on_drives_scanned,
    events.PayloadFound: payload_rules.on_payload_found,
    events.PayloadVerified: payload_rules.on_payload_verified,
    events.WheelsStored: payload_rules.on_wheels_stored,
    events.PayloadActivated: payload_rules.on_payload_activated,
    events.BesideRefused: releases.on_beside_refused,
    events.PayloadDoubted: payload_rules.on_payload_doubted,
    events.TrustChanged: payload_rules.on_trust_changed,
    events.RollbackAsked: payload_rules.on_rollback_asked,
    events.RetryAsked: component_rules.on_retry_asked,
    events.ForgetAsked: payload_rules.on_forget_asked,
    events.TrialFailed: component_rules.on_trial_failed,
    events.WorkerReady: component_rules.on_worker_news,
    events.WorkerExited: component_rules.on_worker_news,
    events.WorkerFailed: component_rules.on_worker_news,
    events.WorkerStable: component_rules.on_worker_stable,
    events.ConditionEnded: component_rules.on_condition_ended,
    events.DeviceAppeared: component_rules.on_device_appeared,
    events.DeviceChanged: component_rules.on_device_changed,
    events.DeviceRemoved: component_rules.on_device_removed,
    events.MountSet: component_rules.on_mount_set,
    events.InputConnected: component_rules.on_input_connected,
    events.GoalGiven: goal_rules.on_goal_given,
    events.GoalReached: goal_rules.on_goal_over,
    events.GoalEnded: goal_rules.on_goal_over,
    events.HostStable: crash_attribution.on_host_stable,
    events.TrialDue: retry_rules.on_trial_due,
    events.DriveRetried: retry_rules.on_drive_retried,
    events.SafeModeLeft: safe_mode_rules.on_left,
    events.PeerJoined: peer_rules.on_peer_joined,
    events.PeerShared: peer_rules.on_peer_shared,
    events.PeerLeft: peer_rules.on_peer_left,
}
"""Event → rule. Other events change nothing here; the journal keeps those that ask for it."""


def advance(state: HostState, event: Event, at: Moment) -> Outcome:
    """Follow one event, and all that it entails, through the rules."""
    turn = Turn(state, at, pending=[event])
    follow_all(turn)
    return settle(turn, state)


def follow_all(turn: Turn) -> None:
    """Apply the rules until nothing follows any more, releases that are wanted now included."""
    while True:
        while turn.pending:
            follow(turn, turn.pending.pop(0))
        turn.pending.extend(releases.settle(turn))
        if not turn.pending:
            return


def follow(turn: Turn, event: Event) -> None:
    """Apply the rule for one event; what follows from it is left pending."""
    crash_attribution.on_event(turn, event)
    rule = RULES.get(type(event))
    if rule is not None:
        rule(turn, event)
    elif event.JOURNALLED:
        turn.events.append(event)


def settle(turn: Turn, before: HostState) -> Outcome:
    """End a turn: idle drives, claims of devices, and the revision if anything was recomposed."""
    drive_rules.release_idle_drives(turn)
    rebuilding.settle(turn, before)
    if turn.state.components != before.components or turn.state.devices != before.devices:
        device_allocation.settle(turn, before.devices)
    parts = ("components", "mounts", "connections", "former")
    is_recomposed = any(getattr(turn.state, part) != getattr(before, part) for part in parts)
    if is_recomposed or peer_rules.offers(turn.state) != peer_rules.offers(before):
        turn.change(revision=before.revision + 1)
        turn.events.append(events.Recomposed(turn.state.revision, turn.events[0].name))
    return turn.outcome()
