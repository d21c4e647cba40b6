"""What a child process can be asked to do: name → blocking function of plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nondum.host.drives import parcel, reader
from nondum.host.drives.reader import Arguments, Report
from nondum.host.lifecycle import compiling, installing, rebuilding
from nondum.host.trust import chain

Job = Callable[[Arguments, Report], Any]

JOBS: Mapping[str, Job] = {
    "look": reader.look,
    "copy": reader.copy,
    "verify": reader.verify,
    "hand_over": parcel.hand_over,
    "outline": parcel.outline,
    "judge": parcel.judge,
    "install": installing.install,
    "compile": compiling.compile_wheels,
    "prune": installing.prune,
    "listing": installing.listing,
    "trust_load": chain.load,
    "trust_extend": chain.extend,
    "trust_judge_kept": chain.judge_kept,
    "sweep": installing.sweep,
    "found": rebuilding.found,
}
