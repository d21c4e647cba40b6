"""Which drives a person may pull, and what ends then. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from nondum.host.core.records.drive import DriveRecord, DriveState
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.status import is_at_rest
from nondum.host.people.answers import fitting, listed
from nondum.host.people.feedback.state_reasons import (
    PLUGGED,
    Known,
    ending_with,
    is_safe,
    may_be_pulled,
)


def pulling(known: Known, used: Collection[str] = ()) -> str:
    """What a person may pull now; `used` are the components that carry something out.

    >>> from nondum.host.core.records.snapshot import Snapshot
    >>> pulling(Known(Snapshot("rover", 1)))
    'No drive is plugged in.'
    """
    drives = [drive for drive in known.snapshot.drives if drive.kind in PLUGGED]
    if not drives:
        return "No drive is plugged in."
    told = [_of_drive(drive, known, used) for drive in drives]
    each = "; ".join(told)
    return fitting([each[:1].upper() + each[1:], *_counted(told)])


def _of_drive(drive: DriveRecord, known: Known, used: Collection[str]) -> str:
    brought = [p for p in known.snapshot.payloads if drive.id in p.sources]
    if why := next(_not_yet(drive, brought, known), ""):
        return f"leave drive {drive.id} in: {why}"
    if not is_safe(drive, known):
        return f"drive {drive.id} may be pulled: nothing of it is used"
    ending = [id for id in ending_with(drive, known.snapshot) if id in used]
    now = f", and I use {listed(ending)} now" if ending else ""
    return f"{may_be_pulled(drive, known.snapshot)}{now}"


def _not_yet(drive: DriveRecord, brought: list[PayloadRecord], known: Known) -> Iterator[str]:
    """Why a drive is still needed; nothing: it is not."""
    if drive.problems:
        return
    if drive.state is not DriveState.IDLE:
        yield "it is being read"
    for payload in brought:
        if not is_at_rest(payload) and payload.key not in known.places:
            yield f"{payload.payload_id} is being installed"
    if drive.id not in known.unmounted:
        yield "it is still mounted"


def _counted(told: list[str]) -> Iterator[str]:
    """The same where there are too many drives to name."""
    left = sum(words.startswith("leave") for words in told)
    yield f"{len(told) - left} of {len(told)} drives may be pulled, leave the others in"
