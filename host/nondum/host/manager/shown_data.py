"""Shows data to components: links the files into a folder that their workers see, and tells these.

A worker may still read what it has open of data that are gone.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from nondum.host.core import effects
from nondum.host.core.events.event import Event
from nondum.host.core.keyed_queues import in_thread
from nondum.host.core.records.data import DataRecord
from nondum.host.manager.state_folders import Folders, remove
from nondum.host.workers.workers import Workers

_SEEN_BY_ALL = 0o755
"""Mode of the folders: a worker may be another user."""


class ShownData:
    """What each component is shown."""

    def __init__(self, folders: Folders, workers: Workers) -> None:
        self._folders, self._workers = folders, workers

    async def prepare(self, payload: str, components: Iterable[str]) -> None:
        """Make empty folders for components whose workers are about to be started."""
        for component in components:
            await in_thread(_make_empty, self._folders.shown(payload, component))

    async def show(self, effect: effects.ShowData) -> tuple[Event, ...]:
        """Link data into the component's folder and tell its worker, instead of what was there.

        Raises `OSError`.
        """
        folder = self._folders.shown(effect.payload, effect.component) / effect.need
        data = effect.data
        await in_thread(partial(_link, data, folder))
        told = {
            "name": data.name,
            "kind": data.kind,
            "version": data.version,
            "folder": str(folder),
            "files": list(data.files),
        }
        await self._workers.show(effect.component, effect.payload, effect.need, told)
        return ()

    async def hide(self, effect: effects.HideData) -> tuple[Event, ...]:
        """Tell the component's worker, and take the data away."""
        await self._workers.show(effect.component, effect.payload, effect.need, None)
        folder = self._folders.shown(effect.payload, effect.component) / effect.need
        await in_thread(remove, folder)
        return ()


def _make_empty(folder: Path) -> None:
    remove(folder)
    _make(folder.parent)
    _make(folder)


def _link(data: DataRecord, folder: Path) -> None:
    """Have a folder hold the files of data, and nothing else; it appears whole."""
    unfinished = folder.with_name(f".{folder.name}.part")
    remove(unfinished)
    _make(unfinished)
    for file in data.files:
        for parent in reversed((unfinished / file).relative_to(unfinished).parents[:-1]):
            _make(unfinished / parent)
        os.link(data.folder / file, unfinished / file)
    remove(folder)
    unfinished.rename(folder)


def _make(folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    folder.chmod(_SEEN_BY_ALL)
