"""Where a host keeps what it has, and the sweep of what its catalogue does not account for."""

from __future__ import annotations

import logging
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from nondum.host.core.state import HostState
from nondum.host.core.transitions import KEEPS_FOLDER, KEEPS_VENVS
from nondum.host.sandbox.helper import privileged
from nondum.host.workers import scratch
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.store import disk, venvs

PRIVATE, PASSABLE = 0o700, 0o711
PRIVATE_FILE = 0o600
"""Modes of the state folder, and of what is in it."""

log = logging.getLogger(__name__)


@frozen
class Folders:
    """The state folder and what is in it."""

    root: Path

    @property
    def catalogue(self) -> Path:
        """The SQLite file."""
        return self.root / "catalogue.sqlite"

    @property
    def store(self) -> Path:
        """Verified, unpacked wheels."""
        return self.root / "store"

    @property
    def mounts(self) -> Path:
        """Mount points of block devices."""
        return self.root / "mounts"

    @property
    def scratches(self) -> Path:
        """The scratch folders of all components."""
        return self.root / "scratch"

    @property
    def confinement(self) -> Path:
        """What was found out of confining workers here."""
        return self.root / "confinement.json"

    @property
    def of_workers(self) -> tuple[Path, ...]:
        """Where code and scratch of all workers are."""
        return self.root / "venvs", self.scratches

    @property
    def peers(self) -> Path:
        """Key, certificate and trust."""
        return self.root / "peers"

    @property
    def trust(self) -> Path:
        """The trust files that followed the first one."""
        return self.root / "trust"

    @property
    def handover(self) -> Path:
        """Payloads that other hosts are fetching, as far as they do."""
        return self.root / "handover"

    @property
    def placed(self) -> Path:
        """Payloads that other hosts have handed over: each a folder like a drive."""
        return self.root / "placed"

    @property
    def cache(self) -> Path:
        """What was made of payloads that were withdrawn, in case they come back."""
        return self.root / "cache"

    @property
    def planning(self) -> Path:
        """The temporary files of planners."""
        return self.root / "planning"

    @property
    def probes(self) -> Path:
        """Where it is found out how workers can be confined."""
        return self.root / "probes"

    def staging(self, payload: str) -> Path:
        """A payload while it is copied and checked."""
        return self.root / "staging" / payload

    @property
    def payloads(self) -> Path:
        """The checked files of all payloads that are here."""
        return self.root / "payloads"

    def payload(self, payload: str) -> Path:
        """A payload's checked files but its wheels, as long as it is here."""
        return self.payloads / payload

    def venvs(self, payload: str) -> Path:
        """A payload's venvs, one for each component."""
        return self.root / "venvs" / payload

    def shown(self, payload: str, component: str) -> Path:
        """Where a component finds the data that it is shown; with its venv, so that its worker sees
        it wherever that may look."""
        return self.venvs(payload) / ".data" / component

    def scratch(self, payload: str, component: str) -> Path:
        """What a component may write to while it is here; releases of it have one each."""
        return self.scratches_of(payload) / component

    def scratches_of(self, payload: str) -> Path:
        """The scratch folders of a payload's components."""
        return self.scratches / payload

    def note(self, payload: str) -> Path:
        """What tells that a payload was installed for good, and from where."""
        return self.notes / f"{payload}.json"

    @property
    def notes(self) -> Path:
        """These of all payloads."""
        return self.root / "installed"

    def all_payloads(self) -> tuple[Path, ...]:
        """The folders of all payloads that are here."""
        return tuple(sorted(self.payloads.iterdir())) if self.payloads.is_dir() else ()

    def of(self, payload: str) -> tuple[Path, ...]:
        """All folders that are a payload's own."""
        scratches = self.scratches_of(payload)
        kept = self.payload(payload), self.note(payload)
        return self.staging(payload), *kept, self.venvs(payload), scratches


def make_private(folders: Folders) -> None:
    """Let no other user of this machine see what is in the state folder: journal, goals, keys.

    What lies there already is closed as well: older versions left it open. Blocks.
    """
    for path in (folders.root, *folders.root.iterdir()):
        found = path.lstat()
        is_ours = found.st_uid == os.geteuid() or path == folders.root
        for is_kind, mode in ((stat.S_ISDIR, PRIVATE), (stat.S_ISREG, PRIVATE_FILE)):
            if is_ours and is_kind(found.st_mode) and found.st_mode & ~mode & 0o777:
                _change_mode(path, mode)


def let_pass(folders: Folders) -> None:
    """Let workers that are other users than this daemon reach their own code and scratch folders.

    They, and others who know a path, may go through; they cannot list what is there. Blocks.
    """
    for folder in (folders.root, *folders.of_workers):
        folder.mkdir(exist_ok=True)
        _change_mode(folder, PASSABLE)


def _change_mode(path: Path, mode: int) -> None:
    try:
        path.chmod(mode)
    except OSError as error:  # of a file system without modes, or another user's
        log.warning("%s is open to other users: %s", path, error)


def remove_temporary(folders: Folders) -> None:
    """Delete the temporary files of a daemon that was killed. Blocks."""
    for folder in (folders.planning, folders.probes):
        remove(folder)


def sweep(folders: Folders, state: HostState) -> tuple[Path, ...]:
    """Delete every folder and undo every mount that a recovered state does not account for."""
    try:
        privileged().unmount_all(folders.mounts)
    except OSError:
        log.exception("what is mounted below %s could not be undone", folders.mounts)
    orphans = tuple(_orphans(folders, state))
    for orphan in orphans:
        remove(orphan)
    return orphans


def remove(folder: Path) -> None:
    """Delete a folder, whatever a plugin did in it; nothing there is fine.

    What cannot be deleted is left for the next sweep.
    """
    try:
        if folder.is_symlink() or folder.is_file():
            folder.unlink()
        elif folder.is_dir():
            scratch.empty(folder)
            folder.rmdir()
    except OSError as error:
        log.warning("%s is not deleted whole: %s", folder, error)


def move(folder: Path, target: Path) -> None:
    """Rename a folder, in the place of any that is there. What must last is synced by the caller.

    Raises `OSError`.
    """
    remove(target)
    disk.make_folder(target.parent)
    folder.rename(target)


def missing(folders: Folders, state: HostState) -> frozenset[str]:
    """Keys of payloads whose checked files should be there and are not."""
    return frozenset(
        key
        for key, payload in state.payloads.items()
        if payload.step in KEEPS_FOLDER and not folders.payload(key).is_dir()
    )


def of_another_python(state: HostState) -> frozenset[str]:
    """Keys of payloads whose venvs were made by a Python that this one is not."""
    return frozenset(
        component.payload
        for component in state.components.values()
        if component.site_packages != venvs.site_packages(component.venv)
    )


def _orphans(folders: Folders, state: HostState) -> Iterator[Path]:
    steps = {key: payload.step for key, payload in state.payloads.items()}
    kept = {
        "staging": frozenset[str](),
        "cache": frozenset(),
        "handover": frozenset(),
        "placed": frozenset(),
        "payloads": {key for key, step in steps.items() if step in KEEPS_FOLDER},
        "venvs": {key for key, step in steps.items() if step in KEEPS_VENVS},
        "scratch": {key for key, step in steps.items() if step in KEEPS_VENVS},
        "installed": {f"{key}.json" for key, step in steps.items() if step in KEEPS_FOLDER},
    }
    for name, names in kept.items():
        if (folders.root / name).is_dir():
            yield from (p for p in (folders.root / name).iterdir() if p.name not in names)
