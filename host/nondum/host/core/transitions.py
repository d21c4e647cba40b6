"""The life of a payload as tables: which event leads from which step where, and what is then done.

`lifecycle/advance.py` follows them, `lifecycle/recovery.py` the one for a daemon that starts; the
diagram in docs/lifecycle.md is drawn from them, and the kill tests go through every row.
"""

from __future__ import annotations

from collections.abc import Mapping

from nondum.host.core import effects
from nondum.host.core.effects import PayloadEffect
from nondum.host.core.events.drives import DriveReleased
from nondum.host.core.events.event import Event
from nondum.host.core.events.payloads import (
    ComponentsProbed,
    PayloadActivated,
    PayloadCleared,
    PayloadCopied,
    PayloadFailed,
    PayloadFound,
    PayloadRefused,
    PayloadStaged,
    PayloadVerified,
    PayloadWithdrawn,
    RetryAsked,
    WheelsStored,
)
from nondum.host.core.events.placement import PayloadSentAway
from nondum.host.core.events.releases import PayloadResumed, PayloadSuperseded, RollbackAsked
from nondum.host.core.events.trust import PayloadDistrusted
from nondum.host.core.events.workers import WorkerExited, WorkerFailed, WorkerReady
from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.step import Step
from nondum.sdk.frozen import frozen


@frozen
class Transition:
    """Where an event leads, and what is then to be done."""

    to: Step
    effect: type[PayloadEffect] | None = None


_Rows = Mapping[tuple[Step, type[Event]], Transition]

_INSTALLING = (Step.RECEIVED, Step.COPIED, Step.VERIFIED, Step.STAGED)
_PRESENT = (
    *_INSTALLING,
    Step.STORED,
    Step.PROBED,
    Step.ACTIVE,
    Step.SUPERSEDED,
    Step.REFUSED,
    Step.QUARANTINED,
)

TRANSITIONS: _Rows = {
    (Step.GONE, PayloadFound): Transition(Step.RECEIVED, effects.CopyPayload),
    (Step.RECEIVED, PayloadCopied): Transition(Step.COPIED, effects.VerifyPayload),
    (Step.COPIED, PayloadVerified): Transition(Step.VERIFIED, effects.StagePayload),
    (Step.VERIFIED, PayloadStaged): Transition(Step.STAGED, effects.StoreWheels),
    (Step.STAGED, WheelsStored): Transition(Step.STORED, effects.ProbeComponents),
    (Step.STORED, ComponentsProbed): Transition(Step.PROBED, effects.ActivatePayload),
    (Step.PROBED, PayloadActivated): Transition(Step.ACTIVE, effects.CompileWheels),
    **{
        (step, PayloadRefused): Transition(Step.REFUSED, effects.ClearPayload)
        for step in _INSTALLING
    },
    **{
        (step, PayloadFailed): Transition(Step.QUARANTINED, effects.SuspendPayload)
        for step in (Step.STORED, Step.PROBED, Step.ACTIVE)
    },
    (Step.STORED, PayloadSuperseded): Transition(Step.SUPERSEDED, effects.RestPayload),
    (Step.ACTIVE, PayloadSuperseded): Transition(Step.SUPERSEDED, effects.RestPayload),
    (Step.SUPERSEDED, PayloadResumed): Transition(Step.STORED, effects.ProbeComponents),
    **{
        (step, PayloadSentAway): Transition(Step.REFUSED, effects.ClearPayload)
        for step in _PRESENT
        if step is not Step.REFUSED
    },
    **{
        (step, PayloadDistrusted): Transition(Step.REFUSED, effects.ClearPayload)
        for step in _PRESENT
        if step is not Step.REFUSED
    },
    (Step.REFUSED, RetryAsked): Transition(Step.REMOVING, effects.ClearPayload),
    (Step.REFUSED, RollbackAsked): Transition(Step.REMOVING, effects.ClearPayload),
    (Step.QUARANTINED, RetryAsked): Transition(Step.STORED, effects.ProbeComponents),
    **{
        (step, PayloadWithdrawn): Transition(Step.REMOVING, effects.CachePayload)
        for step in _PRESENT
    },
    (Step.REMOVING, PayloadCleared): Transition(Step.GONE),
}
"""(step, event) → transition. What is not here is ignored: it comes from an earlier life."""

HELD: frozenset[type[Event]] = frozenset(
    {
        PayloadCopied,
        PayloadVerified,
        PayloadStaged,
        ComponentsProbed,
        DriveReleased,
    }
)
"""Progress that is not committed by itself: recovery does the same before it and after it. The next
commit writes it, too."""

RECOVERY: Mapping[Step, Transition] = {
    Step.RECEIVED: Transition(Step.GONE),
    Step.COPIED: Transition(Step.GONE),
    Step.VERIFIED: Transition(Step.GONE),
    Step.STAGED: Transition(Step.GONE),
    Step.STORED: Transition(Step.STORED, effects.ProbeComponents),
    Step.PROBED: Transition(Step.STORED, effects.ProbeComponents),
    Step.ACTIVE: Transition(Step.STORED, effects.ProbeComponents),
    Step.SUPERSEDED: Transition(Step.SUPERSEDED),
    Step.REMOVING: Transition(Step.REMOVING, effects.ClearPayload),
    Step.REFUSED: Transition(Step.REFUSED),
    Step.QUARANTINED: Transition(Step.QUARANTINED),
}
"""Where a payload goes that a starting daemon finds at a step: back before STORED, else forward."""

COMPONENT_TRANSITIONS: Mapping[tuple[ComponentState, type[Event]], ComponentState] = {
    (ComponentState.READY, WorkerExited): ComponentState.RESTARTING,
    (ComponentState.RESTARTING, WorkerReady): ComponentState.READY,
    (ComponentState.READY, WorkerFailed): ComponentState.QUARANTINED,
    (ComponentState.RESTARTING, WorkerFailed): ComponentState.QUARANTINED,
    (ComponentState.QUARANTINED, RetryAsked): ComponentState.RESTARTING,
}
"""The same for the components of an active payload."""


def diagram() -> str:
    """The tables as a Mermaid state diagram."""
    lines = ["stateDiagram-v2", f"    [*] --> {Step.GONE.name}"]
    lines += [
        f"    {step.name} --> {row.to.name}: {event.__name__}"
        for (step, event), row in TRANSITIONS.items()
    ]
    return "\n".join(lines) + "\n"


KEEPS_VENVS = frozenset({Step.STORED, Step.PROBED, Step.ACTIVE, Step.SUPERSEDED})


KEEPS_FOLDER = KEEPS_VENVS | {Step.STAGED, Step.QUARANTINED}
"""Steps at which a payload's checked files are there."""
