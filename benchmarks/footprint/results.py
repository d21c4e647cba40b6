"""What was measured on one machine, as it is kept beside this module until it is measured again."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).with_name("figures")


@dataclass(frozen=True, slots=True)
class Footprint:
    """A host at rest, and one with one worker whose plugin imports nothing but the SDK."""

    machine: str
    """What it was measured on, in words; an emulated one is called so."""
    is_emulated: bool
    start_s: float
    """From the start of its process to what it tells systemd: ready. Others delay it."""
    start_cpu_s: float
    """Processor time of its process until then; what other processes use does not count."""
    yardstick_s: float
    """What the yardstick of `probe.py` takes of one there."""
    idle: dict[str, Any]
    """`probe.look` at the host alone."""
    with_worker: dict[str, list[int]]
    """`probe.memory` with the worker, in kB."""
    apart: dict[str, list[int]] = field(default_factory=dict)
    """That of the host alone, with a process for its links to peers; empty where not measured."""
    packages_kb: int | None = None
    """That of an interpreter which imports the packages of others that a daemon does, and no more;
    None where not measured."""

    @property
    def packages_mb(self) -> float | None:
        """That of an interpreter with the packages of others alone."""
        return None if self.packages_kb is None else self.packages_kb * 1024 / 1e6

    @property
    def daemon_mb(self) -> float:
        """Proportional set size of the idle daemon."""
        return float(self.idle["memory_kb"]["daemon"][0]) * 1024 / 1e6

    @property
    def worker_mb(self) -> float:
        """That of the worker: the greatest of them, the other being the spare."""
        return float(max(self.with_worker["worker"])) * 1024 / 1e6

    @property
    def all_mb(self) -> float:
        """That of the idle daemon and all that it keeps ready."""
        return sum(map(self.mb_of, self.idle["memory_kb"]))

    def apart_mb(self, kind: str) -> float | None:
        """That of the processes of a kind, beside a process for links to peers."""
        return sum(self.apart[kind]) * 1024 / 1e6 if self.apart else None

    def mb_of(self, kind: str) -> float:
        """That of all processes of a kind beside the idle daemon."""
        kilobytes: int = sum(self.idle["memory_kb"].get(kind, []))
        return kilobytes * 1024 / 1e6


def keep(name: str, footprint: Footprint) -> None:
    """Put it in the place of what was measured on the same kind of machine before."""
    FOLDER.mkdir(exist_ok=True)
    text = json.dumps(asdict(footprint), indent=1) + "\n"
    (FOLDER / f"{name}.json").write_text(text, encoding="utf-8")


def kept() -> list[Footprint]:
    """All that is known, those of real machines first."""
    files = sorted(FOLDER.glob("*.json"))
    found = [Footprint(**json.loads(file.read_text(encoding="utf-8"))) for file in files]
    return sorted(found, key=lambda footprint: footprint.is_emulated)
