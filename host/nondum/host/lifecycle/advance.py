"""The component manager's function: (state, event) → (state, effects, events to journal).

Pure: it reads no clock and touches nothing. News that means nothing any more (of a payload that is
gone, of a component that was withdrawn) gives the same state and no events.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nondum.host.core.events.catalogue import Recomposed
from nondum.host.core.events.daemon import HostStable, SafeModeLeft, TrialDue
from nondum.host.core.events.devices import DeviceAppeared, DeviceChanged, DeviceRemoved
from nondum.host.core.events.drives import (
    DriveInserted,
    DriveRead,
    DriveRemoved,
    DriveRetried,
    DrivesScanned,
    DriveUnreadable,
)
from nondum.host.core.events.event import Event
from nondum.host.core.events.goals import GoalEnded, GoalGiven, GoalReached
from nondum.host.core.events.inputs import InputConnected
from nondum.host.core.events.mounts import MountSet
from nondum.host.core.events.payloads import (
    ForgetAsked,
    PayloadActivated,
    PayloadFound,
    PayloadVerified,
    RetryAsked,
    WheelsStored,
)
from nondum.host.core.events.peers import PeerJoined, PeerLeft, PeerShared
from nondum.host.core.events.releases import BesideRefused, RollbackAsked, TrialFailed
from nondum.host.core.events.trust import PayloadDoubted, TrustChanged
from nondum.host.core.events.workers import (
    ConditionEnded,
    WorkerExited,
    WorkerFailed,
    WorkerReady,
    WorkerStable,
)
from nondum.host.core.records.moment import Moment
from nondum.host.core.state import HostState
from nondum.host.core.transitions import TRANSITIONS
from nondum.host.lifecycle import (
    component_rules,
    crash_attribution,
    data_allocation,
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
    DriveInserted: drive_rules.on_drive_inserted,
    DriveRemoved: drive_rules.on_drive_removed,
    DriveRead: drive_rules.on_drive_read,
    DriveUnreadable: drive_rules.on_drive_unreadable,
    DrivesScanned: drive_rules.on_drives_scanned,
    PayloadFound: payload_rules.on_payload_found,
    PayloadVerified: payload_rules.on_payload_verified,
    WheelsStored: payload_rules.on_wheels_stored,
    PayloadActivated: payload_rules.on_payload_activated,
    BesideRefused: releases.on_beside_refused,
    PayloadDoubted: payload_rules.on_payload_doubted,
    TrustChanged: payload_rules.on_trust_changed,
    RollbackAsked: payload_rules.on_rollback_asked,
    RetryAsked: component_rules.on_retry_asked,
    ForgetAsked: payload_rules.on_forget_asked,
    TrialFailed: component_rules.on_trial_failed,
    WorkerReady: component_rules.on_worker_news,
    WorkerExited: component_rules.on_worker_news,
    WorkerFailed: component_rules.on_worker_news,
    WorkerStable: component_rules.on_worker_stable,
    ConditionEnded: component_rules.on_condition_ended,
    DeviceAppeared: component_rules.on_device_appeared,
    DeviceChanged: component_rules.on_device_changed,
    DeviceRemoved: component_rules.on_device_removed,
    MountSet: component_rules.on_mount_set,
    InputConnected: component_rules.on_input_connected,
    GoalGiven: goal_rules.on_goal_given,
    GoalReached: goal_rules.on_goal_over,
    GoalEnded: goal_rules.on_goal_over,
    HostStable: crash_attribution.on_host_stable,
    TrialDue: retry_rules.on_trial_due,
    DriveRetried: retry_rules.on_drive_retried,
    SafeModeLeft: safe_mode_rules.on_left,
    PeerJoined: peer_rules.on_peer_joined,
    PeerShared: peer_rules.on_peer_shared,
    PeerLeft: peer_rules.on_peer_left,
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
    """End a turn: idle drives, claims of devices and data, and the revision if anything was
    recomposed."""
    drive_rules.release_idle_drives(turn)
    rebuilding.settle(turn, before)
    if turn.state.components != before.components or turn.state.devices != before.devices:
        device_allocation.settle(turn, before.devices)
    if turn.state.components != before.components or turn.state.data != before.data:
        data_allocation.settle(turn)
    parts = ("components", "mounts", "connections", "former", "data")
    is_recomposed = any(getattr(turn.state, part) != getattr(before, part) for part in parts)
    if is_recomposed or peer_rules.offers(turn.state) != peer_rules.offers(before):
        turn.change(revision=before.revision + 1)
        turn.events.append(Recomposed(turn.state.revision, turn.events[0].name))
    return turn.outcome()
