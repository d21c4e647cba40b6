"""A hundred drives at once: sound ones, copies of one, hostile ones and holiday pictures."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.faults.hostile.case import Bench
from tests.faults.hostile.folders import litter
from tests.kit.descendants import descendants
from tests.kit.payloads import Part, make_payload
from tests.kit.running_host import Row, RunningHost

SOUND = '''"""Does nothing, well."""
from nondum.sdk import Unit, hookimpl

@hookimpl
def units():
    return [Unit("lamp", "light")]
'''
OVER = ("active", "refused", "quarantined")
UNDER_WAY = ("copied", "verified", "staged", "stored")
OVER_S = 300.0


@dataclass(frozen=True)
class Crowd:
    """What a crowd came to."""

    drives: int
    plugged_s: float
    """Until the last was in."""
    over_s: float
    """Until each was active, refused or let go."""
    memory_mb: float
    """The most that the daemon ever had."""
    children: int
    """The most processes that read drives at the same time, as far as was seen."""
    most_at_once: int
    """The most payloads that were being installed at the same time."""
    queued: int
    """How many drives and payloads were shown as waiting."""
    active: int
    refused: int
    let_go: int


def make(folder: Path, count: int) -> list[Path]:
    """Drives, of four kinds by turns."""
    drives = [folder / f"c{number}" for number in range(count)]
    kinds = itertools.cycle((sound, same, hostile, holiday))
    for number, (drive, write) in enumerate(zip(drives, kinds, strict=False)):
        write(drive, number)
    return drives


def sound(drive: Path, number: int) -> None:
    """A payload that is on no other drive."""
    part = Part(f"lamp{number}", SOUND)
    make_payload(drive, part, payload_id=f"org.example.lamp{number}")


def same(drive: Path, number: int) -> None:
    """One more copy of one payload."""
    first = drive.parent / "same"
    if not first.exists():
        make_payload(first, Part("same", SOUND), payload_id="org.example.same")
    shutil.copytree(first, drive)


def hostile(drive: Path, number: int) -> None:
    """A payload with a file that was changed."""
    sound(drive, number)
    with (drive / f"nondum/org.example.lamp{number}/index.json").open("ab") as index:
        index.write(b" ")


def holiday(drive: Path, number: int) -> None:
    """Nothing for a robot."""
    drive.mkdir(parents=True)
    litter(Bench(drive, number, drive.parent / "canary"))


def plug_all(host: RunningHost, drives: list[Path], within_s: float) -> Crowd:
    """Plug them in, evenly spread over a time, and see to the end of it."""
    began = time.monotonic()
    for number, drive in enumerate(drives):
        time.sleep(max(0.0, began + within_s * number / len(drives) - time.monotonic()))
        host.plug(drive)
    plugged_s = time.monotonic() - began
    seen = [0]

    def is_over(view: Row) -> bool:
        seen.append(len(list(readers(host.pid))))
        return (
            len(view["drives"]) == len(drives)
            and all(row["state"] == "idle" for row in view["drives"])
            and all(row["state"] in OVER for row in view["payloads"])
        )

    host.until("all over", is_over, timeout_s=OVER_S)
    view = host.view
    return Crowd(
        drives=len(drives),
        plugged_s=plugged_s,
        over_s=time.monotonic() - began,
        memory_mb=peak_mb(host.pid),
        children=max(seen),
        most_at_once=max(at_once(view) for view in host.views),
        queued=len({name for view in host.views for name in waiting(view)}),
        active=states(view).count("active"),
        refused=states(view).count("refused"),
        let_go=sum(bool(row["problems"]) for row in view["drives"]),
    )


def states(view: Row) -> list[str]:
    """The states of all payloads."""
    return [row["state"] for row in view["payloads"]]


def readers(daemon: int) -> Iterator[int]:
    """Processes that read drives for a daemon, or are ready to."""
    for pid in descendants(daemon):
        with contextlib.suppress(OSError):  # it ended meanwhile
            if b"nondum.host.jobs.child" in Path(f"/proc/{pid}/cmdline").read_bytes():
                yield pid


def at_once(view: Row) -> int:
    """How many payloads are surely on their way: neither waiting, nor at the very end of it."""
    return sum(row["state"] in UNDER_WAY for row in view["payloads"])


def is_queued(row: Row) -> bool:
    """Whether a payload is told to wait."""
    return row["state"] == "received" and (row["progress"] or {}).get("phase") == "queued"


def waiting(view: Row) -> list[str]:
    """Drives and payloads that are told to wait."""
    drives = [row["drive"] for row in view["drives"] if row["state"] == "queued"]
    return drives + [row["payload"] for row in view["payloads"] if is_queued(row)]


def peak_mb(pid: int) -> float:
    """The most memory that a process ever had."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(next(line.split()[1] for line in status.splitlines() if "VmHWM" in line)) / 1024
