"""Finds out which levels of confinement this machine has, by confining a process and asking it
what it can see and do. What was found is kept until something changes that it depends on.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import platform
import socket
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from nondum.host.config.confinement_level import Finding
from nondum.host.sandbox.helper import privileged
from nondum.host.sandbox.levels import bubblewrap, landlock, refusals, visibility
from nondum.host.workers import scratch
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held
from nondum.host.workers.launcher import parameters
from nondum.host.workers.spare import Spare
from nondum.host.workers.spec import WorkerSpec, base_interpreter
from nondum.sdk.description import PluginDescription
from nondum.wheelhouse.format.confinement import Level

ANSWER_S = 30.0
"""How long a process is waited for that is to look around."""
_ANSWER_BYTES = 65_536
log = logging.getLogger(__name__)


def findings(kept_in: Path | None = None, place: Path | None = None) -> tuple[Finding, ...]:
    """The highest level that there is, above it those that there are not and why, highest first.

    Takes a tenth of a second, or nothing if `kept_in`, a file of the state folder, holds what still
    counts. Processes try it in `place`, a folder of the state folder, or among temporary files.
    Blocks; the thread that calls must live until it returns. Raises nothing.
    """
    key = _conditions()
    if kept_in is not None and (kept := _kept(kept_in, key)) is not None:
        return kept
    found = tuple(_until_available(_each(place)))
    if kept_in is not None and not _shares_users_despite_helper(found):
        _keep(kept_in, key, found)
    return found


def all_findings(place: Path | None = None) -> tuple[Finding, ...]:
    """What trying out every level has shown, highest first. Blocks, see `findings`."""
    return tuple(_each(place))


def _until_available(each: Iterator[Finding]) -> Iterator[Finding]:
    for finding in each:
        yield finding
        if finding.is_available:
            return


def _shares_users_despite_helper(found: tuple[Finding, ...]) -> bool:
    """Whether workers share a user although the helper is there: it may do better next time."""
    has_helper = os.geteuid() != 0 and bool(privileged().users)
    return has_helper and not any(finding.has_users for finding in found)


def _each(place: Path | None) -> Iterator[Finding]:
    if not refusals.is_known(refusals.machine()):
        log.warning("system calls cannot be filtered on %s", refusals.machine())
    bwrap = bubblewrap.program()
    yield visibility.MISSING if bwrap is None else _sandboxed(bwrap, place)
    if not landlock.version():
        yield visibility.failed(Level.RESTRICTED, "the kernel has no Landlock")
    else:
        yield _tried(Held(), place)


def _sandboxed(bwrap: str, place: Path | None) -> Finding:
    """Level `sandboxed`, with a separate user for each worker where that is possible."""
    if not privileged().users:
        why = "only root, or the helper of the service, can give each its own"
        return visibility.sharing(_tried(Boxed(bwrap), place), why)
    own = _tried(Boxed(bwrap, has_users=True), place)
    if own.has_users:
        return own
    # Whether files can be shown as those of another user is a matter of their file system.
    return visibility.sharing(_tried(Boxed(bwrap)), f"separate ones are not possible: {own.reason}")


def _tried(confinement: Confinement, place: Path | None = None) -> Finding:
    try:
        if place is not None:
            place.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="nondum-probe-", dir=place) as folder:
            return visibility.judged(confinement.level, _look(confinement, Path(folder)))
    except (OSError, ValueError) as error:
        return visibility.failed(confinement.level, f"it could not be tried: {error}")


def _look(confinement: Confinement, folder: Path) -> dict[str, Any]:
    """What a process sees there. Raises `OSError` and `ValueError`."""
    spec = _spec(folder)
    spec.scratch.mkdir(parents=True)
    ground = confinement.ground(spec)
    spare = Spare(confinement, ground)
    try:
        spare.settle(ANSWER_S)
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with ours, theirs:
            with confinement.entry(spec, ground) as entry:
                if entry.user is not None and not entry.maps_scratch:
                    scratch.give(spec.scratch, entry.user)
                spare.become(parameters(spec, entry, looks=True), theirs, entry.ruleset)
                if entry.user is not None and entry.maps_scratch:
                    spare.map_scratch(entry.user, ANSWER_S)
            theirs.close()
            ours.settimeout(ANSWER_S)
            seen = ours.recv(_ANSWER_BYTES)
        if not seen:
            spare.close()
            raise OSError(spare.said or "it ended at once")
        answer: dict[str, Any] = json.loads(seen)
        return answer
    finally:
        spare.close()


def _spec(folder: Path) -> WorkerSpec:
    return WorkerSpec(
        component="probe",
        payload="",
        distribution="",
        entry_point="",
        site_packages=(),
        python=base_interpreter(),
        scratch=folder / "payload" / "probe",
        index=PluginDescription("probe", "0"),
    )


def _conditions() -> list[str]:
    """What the findings depend on."""
    boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    bwrap = bubblewrap.program()
    files = [Path(p) for p in (bwrap, base_interpreter(), *_own_code()) if p is not None]
    stamps = [f"{file}:{file.stat().st_mtime_ns}" for file in files]
    users = f"{os.getuid()} and {privileged().users}"
    return [boot, platform.release(), sys.version, users, *stamps]


def _own_code() -> Sequence[Path]:
    folders = (bubblewrap.INSIDE, Path(bubblewrap.__file__).parent, Path(__file__).parent)
    return sorted(file for folder in folders for file in folder.glob("*.py"))


def _kept(file: Path, key: list[str]) -> tuple[Finding, ...] | None:
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        if data["of"] == key:
            return tuple(Finding.from_dict(row) for row in data["findings"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return None


def _keep(file: Path, key: list[str], found: tuple[Finding, ...]) -> None:
    unfinished = file.with_suffix(".part")
    with contextlib.suppress(OSError):  # then it is tried again next time
        text = json.dumps({"of": key, "findings": [finding.to_dict() for finding in found]})
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(file)
