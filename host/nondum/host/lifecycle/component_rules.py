"""What news of workers, devices and people means for the components in the catalogue."""

from __future__ import annotations

from dataclasses import replace

from nondum.host.core.effects import RestartWorker
from nondum.host.core.events.devices import DeviceAppeared, DeviceChanged, DeviceRemoved
from nondum.host.core.events.inputs import InputConnected
from nondum.host.core.events.mounts import MountSet
from nondum.host.core.events.payloads import PayloadFailed, RetryAsked
from nondum.host.core.events.releases import TrialFailed
from nondum.host.core.events.workers import (
    ConditionEnded,
    WorkerExited,
    WorkerFailed,
    WorkerReady,
    WorkerStable,
)
from nondum.host.core.records.component import ComponentRecord, ComponentState
from nondum.host.core.records.device import DeviceRecord
from nondum.host.core.records.mount import MountPose
from nondum.host.core.records.step import Step
from nondum.host.core.transitions import COMPONENT_TRANSITIONS
from nondum.host.lifecycle import known_devices, releases
from nondum.host.lifecycle.payload_rules import on_payload_tried
from nondum.host.lifecycle.turn import Turn
from nondum.sdk.errors import Problem

CONDITION = "CONDITION_RAISED"


def on_worker_news(turn: Turn, event: WorkerReady | WorkerExited | WorkerFailed) -> None:
    """Follow the table of components; one that is not active yet fails with its payload."""
    component = turn.state.components.get(event.component)
    if component is None or event.payload not in ("", component.payload):
        _fail_probed(turn, event)
        return
    state = COMPONENT_TRANSITIONS.get((component.state, type(event)))
    if state is None:
        return
    turn.events.append(event)
    turn.put_component(replace(component, state=state, problems=_problems(component, event)))
    if isinstance(event, WorkerFailed):
        payload = turn.state.payloads[component.payload]
        turn.pending.extend(releases.gives_way(turn.state, payload, event.problems))


def _problems(
    component: ComponentRecord, event: WorkerReady | WorkerExited | WorkerFailed
) -> tuple[Problem, ...]:
    """What is wrong with a component. Why a worker ended stays until the next one is steady; that
    of its conditions is over with the worker."""
    match event:
        case WorkerFailed():
            return event.problems
        case WorkerExited():
            return (event.problem,) if event.problem is not None else ()
    return component.problems


def on_worker_stable(turn: Turn, event: WorkerStable) -> None:
    """Forget why the worker before this one ended; what its own conditions ended with stays."""
    component = turn.state.components.get(event.component)
    if component is None or event.payload not in ("", component.payload):
        return
    left = tuple(p for p in component.problems if p.code == CONDITION)
    if left != component.problems and component.state is ComponentState.READY:
        turn.events.append(event)
        turn.put_component(replace(component, problems=left))


def on_condition_ended(turn: Turn, event: ConditionEnded) -> None:
    """Keep the error with the component, which goes on without the condition. May be told twice."""
    component = turn.state.components.get(event.component)
    if component is None or event.payload not in ("", component.payload):
        return
    new = tuple(problem for problem in event.problems if problem not in component.problems)
    if new and component.state is ComponentState.READY:
        turn.events.append(event)
        turn.put_component(replace(component, problems=(*component.problems, *new)))


def on_retry_asked(turn: Turn, event: RetryAsked) -> None:
    """Try a refused or quarantined payload, or quarantined components of an active one, again."""
    payload = turn.state.payloads.get(event.payload)
    if payload is not None and payload.step is Step.SUPERSEDED:
        releases.on_retry_asked(turn, payload, event)
        return
    if payload is None or payload.step is not Step.ACTIVE:
        on_payload_tried(turn, event)
        return
    for component in turn.state.components.values():
        state = COMPONENT_TRANSITIONS.get((component.state, RetryAsked))
        if component.payload == payload.key and state is not None:
            turn.put_component(replace(component, state=state, problems=()))
            turn.effects.append(RestartWorker(component.id))
    if turn.effects:
        turn.events.append(event)


def on_mount_set(turn: Turn, event: MountSet) -> None:
    """Keep what a person said, over what any payload says."""
    turn.events.append(event)
    pose = MountPose(event.unit, event.xyz, event.rpy, "person")
    turn.change(mounts={**turn.state.mounts, event.unit: pose})


def on_input_connected(turn: Turn, event: InputConnected) -> None:
    """Keep, or drop, what a person said about an optional input; it outlives the component."""
    turn.events.append(event)
    kept = {name: s for name, s in turn.state.connections.items() if name != event.input}
    turn.change(connections=kept | ({event.input: event.stream} if event.stream else {}))


def on_device_appeared(turn: Turn, event: DeviceAppeared) -> None:
    """Enter a device; who needs it gets it when the turn is settled."""
    turn.events.append(event)
    now_s = turn.at.wall_s
    known = known_devices.seen(turn.state.known_devices, event.found, now_s)
    first_s = known[event.found.identity].first_s
    _put_device(turn, replace(event.found, first_s=first_s, since_s=now_s))
    turn.change(known_devices=known)


def on_device_changed(turn: Turn, event: DeviceChanged) -> None:
    """Take over what is told of a device that is there: who has it keeps what of it still serves,
    and gets what more of it does, when the turn is settled."""
    before = turn.state.devices.get(event.device)
    if before is None:
        return
    turn.events.append(event)
    _put_device(turn, replace(event.found, first_s=before.first_s, since_s=before.since_s))


def on_device_removed(turn: Turn, event: DeviceRemoved) -> None:
    """Forget a device; who had it loses it when the turn is settled."""
    if event.device not in turn.state.devices:
        return
    turn.events.append(event)
    gone = turn.state.devices[event.device]
    known = known_devices.seen(turn.state.known_devices, gone, turn.at.wall_s)
    kept = {id: device for id, device in turn.state.devices.items() if id != event.device}
    turn.change(devices=kept, known_devices=known)


def on_trial_failed(turn: Turn, event: TrialFailed) -> None:
    """Fail a release that was tried. If it took over at that moment, its component is given up."""
    payload = turn.state.payloads.get(event.payload)
    if payload is None:
        return
    turn.events.append(event)
    if payload.step is Step.PROBED:
        turn.pending.append(PayloadFailed(payload.key, event.problems))
    elif payload.step is Step.ACTIVE:
        turn.pending.append(WorkerFailed(event.component, event.problems, event.payload))


def _put_device(turn: Turn, device: DeviceRecord) -> None:
    turn.change(devices={**turn.state.devices, device.id: device})


def _fail_probed(turn: Turn, event: WorkerReady | WorkerExited | WorkerFailed) -> None:
    if not isinstance(event, WorkerFailed):
        return
    for payload in turn.state.payloads.values():
        is_its = event.payload in ("", payload.key) and event.component in payload.components
        if payload.step is Step.PROBED and is_its:
            turn.events.append(event)
            turn.pending.append(PayloadFailed(payload.key, event.problems))
