"""What was left alone since daemons died at it is tried again: once by itself, or as a person asks.

Not all that daemons seem to die of is to blame: power that fails for a moment counts as a death.
"""

from __future__ import annotations

from nondum.host.core.events.daemon import TrialDue
from nondum.host.core.events.drives import DriveRetried
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.safety import Safety
from nondum.host.core.state import HostState
from nondum.host.lifecycle import crash_attribution, drive_rules
from nondum.host.lifecycle.retry_causes import is_unread
from nondum.host.lifecycle.turn import Turn
from nondum.sdk.errors import Problem

WHY = "it was left alone for a while"


def on_trial_due(turn: Turn, event: TrialDue) -> None:
    """Try one of those again that had no trial yet. If a daemon dies of it, it had its trial."""
    state = turn.state
    if state.safety is not Safety.OFF or crash_attribution.ON_TRIAL in state.tries.values():
        return
    waiting = sorted(s for s in state.tries if crash_attribution.is_left_alone(state, s))
    for subject in waiting:
        if state.tries[subject] < crash_attribution.ON_TRIAL and _try(turn, subject):
            turn.change(tries={**state.tries, subject: crash_attribution.ON_TRIAL})
            return


def on_drive_retried(turn: Turn, event: DriveRetried) -> None:
    """Look at a drive that was left alone, or that the helper did not get to."""
    drive = turn.state.drives.get(event.drive)
    if drive is None or drive.state is not DriveState.IDLE:
        return
    if is_quarantined(drive.problems) or is_unread(drive.problems):
        turn.events.append(event)
        drive_rules.read(turn, drive)


def is_quarantined(problems: tuple[Problem, ...]) -> bool:
    """Whether that is what is wrong with a drive or payload."""
    return any(problem.code == "QUARANTINED" for problem in problems)


def _try(turn: Turn, subject: str) -> bool:
    """Whether there was something to try."""
    drive = _drive(turn.state, subject)
    payload = turn.state.payloads.get(subject)
    if drive:
        turn.pending.append(DriveRetried(drive, WHY))
    elif payload is not None and is_quarantined(payload.problems):
        turn.pending.append(RetryAsked(payload.key, WHY))
    else:
        return False
    return True


def _drive(state: HostState, subject: str) -> str:
    drives = (d for d in state.drives.values() if crash_attribution.subject_of(d) == subject)
    return next((d.id for d in drives if is_quarantined(d.problems)), "")
