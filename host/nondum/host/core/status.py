"""Whether anything is being done for payloads, and what components wait for, in words."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.core import waiting
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.drive import DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.records.step import Step
from nondum.sdk.errors import Problem

_AT_REST = frozenset({Step.GONE, Step.ACTIVE, Step.SUPERSEDED, Step.REFUSED, Step.QUARANTINED})


def is_at_rest(payload: PayloadRecord) -> bool:
    """Whether nothing is being done for a payload."""
    return payload.step in _AT_REST


def coming_in(snapshot: Snapshot) -> str:
    """What is being installed: "3 payloads are still being installed". Empty: nothing."""
    payloads = sum(
        not is_at_rest(payload) and payload.step is not Step.REMOVING
        for payload in snapshot.payloads
    )
    drives = sum(drive.state is DriveState.READING for drive in snapshot.drives)
    parts = (
        _counted(payloads, "payload", "still being installed"),
        _counted(drives, "drive", "still being read"),
    )
    return " and ".join(filter(None, parts))


def _counted(number: int, noun: str, doing: str) -> str:
    if not number:
        return ""
    return f"1 {noun} is {doing}" if number == 1 else f"{number} {noun}s are {doing}"


def waits(component: ComponentRecord) -> Iterator[Problem]:
    """That a component waits for devices or data, if it does and for nothing else."""
    if told := waiting.waits(component):
        code = "DEVICE_MISSING" if component.missing_devices else "DATA_MISSING"
        yield Problem(code, f"{component.id} {told}")
