"""Which payloads are to run on other hosts, and which of those to ask first. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from nondum.host.core.records.drive import DriveRecord
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.records.step import Step
from nondum.host.core.state import HostState
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers import PeerKey

PLACED = "placed"
"""Kind of the drives that stand for what other hosts have handed over."""
FIXED_KINDS = frozenset({PLACED, "installed"})
"""Drives whose payloads stay where they are: a payload is placed once, and what was installed for
good is there for good."""

OTHERS_MAY_FIT = frozenset(
    {
        "CONFINEMENT",
        "DISK_FULL",
        "LOCK_INCOMPLETE",
        "NONDUM_VERSION",
        "NO_GPU_KIND",
        "NO_GPU_MEMORY",
        "NO_MEMORY",
        "PYTHON_VERSION",
        "WHEEL_INCOMPATIBLE",
    }
)
"""What keeps a payload from one machine and not from another. All else is wrong with the payload,
or a matter of trust."""
ELSEWHERE = "PLACED_ELSEWHERE"
"""Refused here because a person wants it to run on another host."""

INSTALLING = frozenset({Step.RECEIVED, Step.COPIED, Step.VERIFIED, Step.STAGED})
_HERE = INSTALLING | {
    Step.STORED,
    Step.PROBED,
    Step.ACTIVE,
    Step.SUPERSEDED,
    Step.QUARANTINED,
}

Compute: TypeAlias = Mapping[str, Any]


@frozen
class Parcel:
    """A payload that is to run on another host."""

    key: str
    digest: str
    payload_id: str
    version: str
    drive: DriveRecord
    folder: Path
    """Where it is on the drive."""
    problems: tuple[Problem, ...]
    """Why it does not run here."""
    pinned_to: str = ""
    """The only host that a person lets it run on; empty: any."""
    step: Step = Step.REFUSED
    """How far it has come here."""

    @property
    def why(self) -> str:
        """Why it does not run here, for people."""
        if self.pinned_to:
            return "a person wants it there"
        return "; ".join(dict.fromkeys(_need(problem) for problem in self.problems))


@frozen
class Candidate:
    """A peer that takes payloads."""

    key: PeerKey
    host: str
    epoch: int
    """Names its run."""
    compute: Compute
    """What it says that it has to compute with."""


def parcels(state: HostState, pins: Mapping[str, str]) -> dict[str, Parcel]:
    """The payloads that are to run elsewhere, by key. `pins` are payload id → host."""
    found = {}
    for payload in state.payloads.values():
        pinned_to = pins.get(payload.payload_id, "")
        source = movable_source(payload, state)
        if source is not None and _may_run_elsewhere(payload, pinned_to):
            drive, folder = source
            found[payload.key] = Parcel(
                key=payload.key,
                digest=payload.digest,
                payload_id=payload.payload_id,
                version=payload.version,
                drive=drive,
                folder=folder,
                problems=payload.problems,
                pinned_to=pinned_to,
                step=payload.step,
            )
    return found


def movable_source(payload: PayloadRecord, state: HostState) -> tuple[DriveRecord, Path] | None:
    """The first drive that it can be handed over from, and where on it; None: it stays here."""
    if any(state.drives[name].kind in FIXED_KINDS for name in _present(payload, state)):
        return None
    return next(
        ((state.drives[name], payload.sources[name]) for name in _present(payload, state)), None
    )


def sent_away(parcel: Parcel, host: str) -> Problem:
    """What is told of a payload that a person has placed elsewhere."""
    return Problem(
        "PLACED_ELSEWHERE",
        f"it is to run on {host} only",
        where=parcel.payload_id,
        fix=f"have it run here again with `nondum place {parcel.payload_id} --here`",
    )


def ranked(candidates: Iterable[Candidate], parcel: Parcel, here: Compute) -> tuple[Candidate, ...]:
    """The peers to ask, best first: those that have more of what is lacking here, then those with
    the most free memory. Each judges for itself in the end."""
    codes = {problem.code for problem in parcel.problems}

    def rank(candidate: Candidate) -> tuple[int, float, float, str]:
        there = candidate.compute
        better = sum(_is_better(code, here, there) for code in codes)
        gpu = _amount(there, "gpu_memory_mb") if "NO_GPU_MEMORY" in codes else 0.0
        return -better, -gpu, -_amount(there, "memory_mb"), candidate.host

    wanted = (c for c in candidates if c.compute.get("place") is True)
    return tuple(sorted((c for c in wanted if parcel.pinned_to in ("", c.host)), key=rank))


def _may_run_elsewhere(payload: PayloadRecord, pinned_to: str) -> bool:
    if payload.step is Step.REFUSED:
        codes = {problem.code for problem in payload.problems}
        may_fit = OTHERS_MAY_FIT | ({ELSEWHERE} if pinned_to else set())
        return bool(codes) and codes <= may_fit
    return bool(pinned_to) and payload.step in _HERE


def _present(payload: PayloadRecord, state: HostState) -> list[str]:
    return [name for name in payload.sources if name in state.drives]


def _need(problem: Problem) -> str:
    return f"needs {problem.need}" if problem.need else problem.message


def _more(name: str) -> Callable[[Compute, Compute], bool]:
    return lambda here, there: _amount(there, name) > _amount(here, name)


def _another(*names: str) -> Callable[[Compute, Compute], bool]:
    return lambda here, there: any(there.get(name) != here.get(name) for name in names)


def _has_other_gpu(here: Compute, there: Compute) -> bool:
    """Whether a peer has a kind of GPU that this host has not."""
    return bool(_kinds(there) - _kinds(here))


def _kinds(compute: Compute) -> frozenset[str]:
    told = compute.get("gpu_kinds")
    return frozenset(map(str, told)) if isinstance(told, list | tuple) else frozenset()


_BETTER: Mapping[str, Callable[[Compute, Compute], bool]] = {
    "DISK_FULL": _more("disk_mb"),
    "LOCK_INCOMPLETE": _another("machine", "python"),
    "NONDUM_VERSION": _another("nondum"),
    "NO_GPU_KIND": _has_other_gpu,
    "NO_GPU_MEMORY": _more("gpu_memory_mb"),
    "NO_MEMORY": _more("memory_mb"),
    "PYTHON_VERSION": _another("python"),
    "WHEEL_INCOMPATIBLE": _another("machine", "python"),
}


def _is_better(code: str, here: Compute, there: Compute) -> bool:
    return code in _BETTER and _BETTER[code](here, there)


def _amount(compute: Compute, name: str) -> float:
    """A number that a peer tells; nothing, if it is none."""
    value = compute.get(name)
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else 0.0
