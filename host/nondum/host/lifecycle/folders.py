"""Where a host keeps what it has, and the sweep of what its catalogue does not account for."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from nondum.host.catalogue.records import Step
from nondum.host.catalogue.state import HostState
from nondum.host.drives import mounting
from nondum.sdk.errors import ConfigRefused, Problem

_KEEPS_FOLDER = frozenset({Step.STAGED, Step.STORED, Step.PROBED, Step.ACTIVE, Step.QUARANTINED})
_KEEPS_VENVS = frozenset({Step.STORED, Step.PROBED, Step.ACTIVE})


@dataclass(frozen=True, slots=True)
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
    def peers(self) -> Path:
        """Key, certificate and trust."""
        return self.root / "peers"

    @property
    def handover(self) -> Path:
        """Payloads that other hosts are fetching, as far as they do."""
        return self.root / "handover"

    @property
    def placed(self) -> Path:
        """Payloads that other hosts have handed over: each a folder like a drive."""
        return self.root / "placed"

    def staging(self, payload: str) -> Path:
        """A payload while it is copied and checked."""
        return self.root / "staging" / payload

    def payload(self, payload: str) -> Path:
        """A payload's checked files but its wheels, as long as it is here."""
        return self.root / "payloads" / payload

    def venvs(self, payload: str) -> Path:
        """A payload's venvs, one for each component."""
        return self.root / "venvs" / payload

    def scratch(self, component: str) -> Path:
        """What a component may write to while it is here."""
        return self.scratches / component

    def all_payloads(self) -> tuple[Path, ...]:
        """The folders of all payloads that are here."""
        folder = self.root / "payloads"
        return tuple(sorted(folder.iterdir())) if folder.is_dir() else ()

    def of(self, payload: str) -> tuple[Path, ...]:
        """All folders that are a payload's own, but for its components' scratch."""
        return self.staging(payload), self.payload(payload), self.venvs(payload)


def claim(folders: Folders) -> int:
    """Make the state folder this daemon's alone. Returns the descriptor that holds the claim.

    Raises `ConfigRefused` (ALREADY_RUNNING).
    """
    folders.root.mkdir(parents=True, exist_ok=True)
    held = os.open(folders.root / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(held)
        problem = Problem(
            "ALREADY_RUNNING",
            "another daemon uses this state folder",
            where=str(folders.root),
            fix="stop that one, or give this host another `state` folder",
        )
        raise ConfigRefused(problem) from error
    return held


def sweep(folders: Folders, state: HostState) -> tuple[Path, ...]:
    """Delete every folder and undo every mount that a recovered state does not account for."""
    mounting.unmount_all(folders.mounts)
    orphans = tuple(_orphans(folders, state))
    for orphan in orphans:
        remove(orphan)
    return orphans


def remove(folder: Path) -> None:
    """Delete a folder, whatever a plugin did to the permissions in it; nothing there is fine."""
    if folder.is_symlink() or folder.is_file():
        folder.unlink()
        return
    for path, inner, _ in os.walk(folder):
        for name in inner:
            with contextlib.suppress(OSError):  # a link that leads nowhere
                Path(path, name).chmod(0o700)
    shutil.rmtree(folder, ignore_errors=True)


def _orphans(folders: Folders, state: HostState) -> Iterator[Path]:
    steps = {key: payload.step for key, payload in state.payloads.items()}
    kept = {
        "staging": frozenset[str](),
        "handover": frozenset(),
        "placed": frozenset(),
        "payloads": {key for key, step in steps.items() if step in _KEEPS_FOLDER},
        "venvs": {key for key, step in steps.items() if step in _KEEPS_VENVS},
        "scratch": {
            component
            for payload in state.payloads.values()
            if payload.step in _KEEPS_VENVS
            for component in payload.components
        },
    }
    for name, names in kept.items():
        if (folders.root / name).is_dir():
            yield from (p for p in (folders.root / name).iterdir() if p.name not in names)
