"""What drives that come, are read and go mean for the payloads on them."""

from __future__ import annotations

from dataclasses import replace

from nondum.host.core.effects import CopyPayload, ReadDrive, ReleaseDrive
from nondum.host.core.events.drives import (
    DriveInserted,
    DriveRead,
    DriveRemoved,
    DrivesScanned,
    DriveUnreadable,
)
from nondum.host.core.events.payloads import PayloadFound, PayloadWithdrawn
from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.host.lifecycle import crash_attribution, releases, safe_mode
from nondum.host.lifecycle.turn import Turn
from nondum.sdk.errors import Problem

_AT_WORK = releases.STARTING | {Step.ACTIVE}
_GONE = {"placed": "the host that handed it over ended that, or is gone"}
"""What is told of payloads whose last drive is gone, for kinds that no person pulls."""


def on_drive_inserted(turn: Turn, event: DriveInserted) -> None:
    """Read a drive, unless it is left alone. A drive that was there before the daemon's restart, or
    was written again in place, is read again."""
    turn.events.append(event)
    drive = DriveRecord(
        id=event.drive,
        kind=event.kind,
        root=event.root,
        node=event.node,
        filesystem=event.filesystem,
        since=turn.at,
        mark=event.mark,
    )
    if problems := (
        *event.problems,
        *crash_attribution.drive_problems(turn.state, drive),
        *safe_mode.drive_problems(turn.state, drive.kind, drive.id),
    ):
        turn.put_drive(drive)
        turn.pending.append(DriveUnreadable(event.drive, problems))
    else:
        read(turn, drive)


def on_drive_removed(turn: Turn, event: DriveRemoved) -> None:
    """Withdraw what was on it and nowhere else."""
    drive = turn.state.drives.get(event.drive)
    if drive is None:
        return
    turn.events.append(event)
    turn.drop_drive(event.drive)
    turn.effects.append(ReleaseDrive(event.drive))
    for payload in _on(turn, event.drive):
        lose_source(turn, payload, event.drive, _GONE.get(drive.kind, "its drive was pulled"))


def on_drive_read(turn: Turn, event: DriveRead) -> None:
    """Withdraw what the drive carried before and does not carry any more. A release in whose place
    another one lies goes on until that is active."""
    drive = turn.state.drives.get(event.drive)
    if drive is None:
        return
    turn.events.append(event)
    nothing = Problem(
        "DRIVE_NOT_PAYLOAD",
        "carries no payload",
        where=event.drive,
        need="a folder nondum/<payload-id>, such as nondum/org.example.talker",
        have="no folder of such a name",
        fix="make one with `nondum payload build`",
    )
    is_empty = not (event.payloads or event.certificates or event.trust_files)
    problems = event.flaws or ((nothing,) if is_empty else ())
    turn.put_drive(replace(drive, state=DriveState.COPYING, problems=problems))
    for payload in _on(turn, event.drive):
        if payload.key in event.payloads or _is_being_replaced(turn.state, payload, event):
            continue
        lose_source(turn, payload, event.drive, "it is not on its drive any more")


def on_drive_unreadable(turn: Turn, event: DriveUnreadable) -> None:
    """Give up copying from it. What was copied before stays until the drive is pulled."""
    drive = turn.state.drives.get(event.drive)
    if drive is None:
        return
    turn.events.append(event)
    turn.put_drive(replace(drive, state=DriveState.COPYING, problems=event.problems))
    for payload in _on(turn, event.drive):
        if payload.step is Step.RECEIVED:
            lose_source(turn, payload, event.drive, str(event.problems[0]))


def on_drives_scanned(turn: Turn, event: DrivesScanned) -> None:
    """Forget drives that were there before a restart and are not there any more."""
    turn.events.append(event)
    known = {drive.id for drive in turn.state.drives.values() if drive.kind == event.kind}
    turn.missed = frozenset(known - set(event.drives))
    turn.pending.extend(map(DriveRemoved, sorted(turn.missed)))


def lose_source(
    turn: Turn, payload: PayloadRecord, drive: str, reason: str, *, rebuilt_as: str = ""
) -> None:
    """Take a drive from a payload's sources; with the last one the payload is withdrawn."""
    first = next(iter(payload.sources), None)
    sources = {name: folder for name, folder in payload.sources.items() if name != drive}
    turn.put_payload(replace(payload, sources=sources))
    if not sources:
        turn.pending.append(PayloadWithdrawn(payload.key, reason, rebuilt_as))
    elif payload.step is Step.RECEIVED and first == drive:
        turn.effects.append(copy_of(turn.state.payloads[payload.key], turn.state))


def drop_rewritten(turn: Turn, found: PayloadFound) -> None:
    """Withdraw what lay where a payload was found, unless it is at work: that goes on until the
    payload in its place is active."""
    for payload in _on(turn, found.drive):
        if payload.sources[found.drive] == found.folder and payload.step not in _AT_WORK:
            reason = "it was built again in its place"
            lose_source(turn, payload, found.drive, reason, rebuilt_as=found.payload)


def drop_replaced(turn: Turn, payload: PayloadRecord) -> None:
    """Withdraw the releases in whose place on its drive a payload lies that is active now."""
    for other in releases.other_releases(turn.state, payload):
        for drive, folder in other.sources.items():
            if payload.sources.get(drive) == folder:
                current = turn.state.payloads[other.key]
                lose_source(turn, current, drive, "another release was built in its place")


def _is_being_replaced(state: HostState, payload: PayloadRecord, read: DriveRead) -> bool:
    """Whether a payload is at work, and what was read lies in its place on its drive."""
    folder = payload.sources[read.drive]
    return payload.step in _AT_WORK and any(
        state.payloads[key].sources.get(read.drive) == folder
        for key in read.payloads
        if key in state.payloads
    )


def read(turn: Turn, drive: DriveRecord) -> None:
    """Have a drive looked through."""
    turn.put_drive(replace(drive, state=DriveState.READING, problems=()))
    place = drive.kind, drive.root, drive.node, drive.filesystem
    turn.effects.append(ReadDrive(drive.id, *place, turn.state.keys()))


def copy_of(payload: PayloadRecord, state: HostState) -> CopyPayload:
    """Copy a payload from its first source."""
    drive, folder = next(iter(payload.sources.items()))
    old = releases.active_release(state, payload)
    return CopyPayload(payload.key, drive, folder, payload.digest, old.key if old else "")


def release_idle_drives(turn: Turn) -> None:
    """Let go of drives that nothing is copied from any more, so that they are safe to pull."""
    copying = {
        name
        for payload in turn.state.payloads.values()
        if payload.step is Step.RECEIVED
        for name in payload.sources
    }
    for drive in turn.state.drives.values():
        if drive.state is DriveState.COPYING and drive.id not in copying:
            turn.put_drive(replace(drive, state=DriveState.IDLE))
            turn.effects.append(ReleaseDrive(drive.id))


def _on(turn: Turn, drive: str) -> list[PayloadRecord]:
    return [payload for payload in turn.state.payloads.values() if drive in payload.sources]
