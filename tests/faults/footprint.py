"""What a daemon takes of its machine, when it is at rest: what must not grow from day to day."""

from __future__ import annotations

import contextlib
import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.kit.descendants import descendants, pids

from nondum.host.sandbox.helper.mountinfo import mounted_below

CALM, CALM_S = 8, 1.6
OWN = ("catalogue", "staging")
"""Of the state folder: what is not counted, for it has its own rules of how long it stays."""


@dataclass(frozen=True)
class Footprint:
    """One look at a daemon."""

    at_s: float
    """When, on a clock that never goes back."""
    rss_mb: float
    pss_mb: float
    """As `rss_mb`, but what is shared with others counts by its share."""
    descriptors: int
    threads: int
    processes: int
    """That it has started, and that those have."""
    zombies: int
    mounts: int
    files: int
    """And folders below its state folder, but for the catalogue and what is staged."""
    catalogue_mb: float

    @classmethod
    def of(cls, pid: int, state: Path) -> Footprint:
        """Look at a daemon that has this state folder, once it is at rest."""
        until_at_rest(pid)
        said = _numbers(Path(f"/proc/{pid}/status"))
        return cls(
            at_s=time.monotonic(),
            rss_mb=said["VmRSS"] / 1024,
            pss_mb=_numbers(Path(f"/proc/{pid}/smaps_rollup"))["Pss"] / 1024,
            descriptors=descriptors(pid),
            threads=said["Threads"],
            processes=len(descendants(pid)),
            zombies=len(list(_zombies(pid))),
            mounts=len(mounted_below(state)),
            files=len(list(_lasting(state))),
            catalogue_mb=sum(f.stat().st_size for f in state.glob("catalogue.sqlite*")) / 2**20,
        )


def slope(footprints: Sequence[Footprint], of: str) -> float:
    """How fast one of the numbers grows: the least squares' line, in its unit an hour."""
    hours = [footprint.at_s / 3600 for footprint in footprints]
    values = [float(getattr(footprint, of)) for footprint in footprints]
    return statistics.linear_regression(hours, values).slope


def descriptors(pid: int) -> int:
    """How many a process has."""
    return len(list(Path(f"/proc/{pid}/fd").iterdir()))


def until_at_rest(pid: int, timeout_s: float = 60.0) -> None:
    """Wait until a process has had the same number of descriptors for a while: what it still makes
    ready or tidies up is done then, as far as anybody outside can tell."""
    end, calm, before = time.monotonic() + timeout_s, 0, -1
    while calm < CALM and time.monotonic() < end:
        now = descriptors(pid)
        calm = calm + 1 if now == before else 0
        before = now
        time.sleep(CALM_S / CALM)


def _numbers(file: Path) -> dict[str, int]:
    """`name:  number …` of each line that has one."""
    found = {}
    for line in file.read_text(encoding="ascii", errors="replace").splitlines():
        name, _, rest = line.partition(":")
        value = rest.split()[:1]
        if value and value[0].isdigit():
            found[name] = int(value[0])
    return found


def _zombies(parent: int) -> Iterator[int]:
    """Children that have ended and that it has not been told of yet."""
    for pid in pids():
        with contextlib.suppress(OSError):
            state, above = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:2]
            if state == "Z" and int(above) == parent:
                yield pid


def _lasting(state: Path) -> Iterator[Path]:
    for folder in state.iterdir():
        if not folder.name.startswith(OWN):
            yield folder
            yield from folder.rglob("*")
