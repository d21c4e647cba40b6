"""Byte-compiling what an active payload runs, in a child process, while its workers run."""

from __future__ import annotations

from pathlib import Path

from nondum.host.jobs import look
from nondum.host.jobs.table import Arguments, Report
from nondum.sdk.errors import InstallFailed, Problem
from nondum.wheelhouse.store import venvs
from nondum.wheelhouse.store.store import Store

MEGABYTE = 1024 * 1024


def compile_wheels(arguments: Arguments, report: Report) -> None:
    """Compile a payload's wheels in the store and link that into its venvs.

    Idempotent; ending it half way loses at most the wheel that is being compiled. Raises
    `InstallFailed` (STORE_MISSING, DISK_FULL, …).
    """
    staged = look.load_staged(Path(arguments["folder"]))
    facts = look.facts_of(arguments)
    store, space = Store(Path(arguments["store"])), facts.free_disk_mb * MEGABYTE
    compiled = {}
    # The small ones first: among them is what all workers have in common.
    for locked in reversed(look.chosen(staged, facts)):
        space = _space_left(store, locked.sha256, space)
        compiled[locked.sha256] = store.compile(
            locked.sha256, progress=lambda _: report("compile", 0, 1)
        )
    for component, wheels in staged.wheels(facts).items():
        venv = Path(arguments["venvs"]) / component
        venvs.add_compiled(venv, [compiled[locked.sha256] for locked in wheels])


def _space_left(store: Store, sha256: str, space: int) -> int:
    """How many of `space` bytes stay free if the compiled files are as large as their sources."""
    stored = store.get(sha256)
    if stored is None or stored.compiled_here is not None:
        return space
    modules = (file.size for file in stored.files if file.path.endswith(".py"))
    left = space - sum(modules)
    if left < 0:
        where = str(store.root)
        raise InstallFailed(
            Problem("DISK_FULL", "there is too little disk space for compiled files", where)
        )
    return left
