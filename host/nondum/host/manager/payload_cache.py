"""What was made of payloads that were withdrawn, so that one that comes back is not copied, checked
and linked once more.

    cache/<key>/payload    its checked files but its wheels
    cache/<key>/venvs      its venvs, made again from the store while nothing else is to be done

A starting daemon deletes all of it. What came with pip is not cached: it would take its disk twice.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nondum.host.manager.state_folders import PRIVATE, Folders, move, remove
from nondum.sdk.frozen import frozen

CACHED = 8
"""Payloads at most; those that were withdrawn last stay."""


@frozen
class CachedPayload:
    """One of them."""

    key: str
    folder: Path
    venvs: Path
    told: Mapping[str, Any]
    """What the job `install` told of it."""
    stamp: str = ""
    """Of its files, as the job `fill_cache` left them; "": it is not done."""

    def places(self) -> dict[str, str]:
        """Where its files are, for the jobs."""
        return {"cached_folder": str(self.folder), "cached_venvs": str(self.venvs)}


class PayloadCache:
    """Payload → what is cached of it. All methods but `get` block."""

    def __init__(self, folders: Folders) -> None:
        self._folders = folders
        self._cached: dict[str, CachedPayload] = {}

    def get(self, key: str) -> CachedPayload | None:
        """What is cached of a payload."""
        return self._cached.get(key)

    def put(self, key: str, told: Mapping[str, Any]) -> None:
        """Take a payload's checked files.

        Raises `OSError`, also where what is in the store cannot be linked: it would be there twice.
        """
        self.drop(key)
        self._folders.cache.mkdir(PRIVATE, exist_ok=True)
        if self._folders.cache.stat().st_dev != self._folders.store.stat().st_dev:
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV), str(self._folders.store))
        root = self._folders.cache / key
        cached = CachedPayload(key, root / "payload", root / "venvs", told)
        move(self._folders.payload(key), cached.folder)
        self._cached[key] = cached

    def filled(self, cached: CachedPayload) -> None:
        """Its venvs are made. The oldest gives way if there are too many."""
        self._cached.pop(cached.key)
        self._cached[cached.key] = cached
        if len(self._cached) > CACHED:
            self.drop(next(iter(self._cached)))

    def take(self, cached: CachedPayload, staging: Path) -> None:
        """Move its files to staging, its venvs where workers find them. Raises `OSError`."""
        move(cached.folder, staging)
        move(cached.venvs, self._folders.venvs(cached.key))
        self.drop(cached.key)

    def drop(self, key: str) -> None:
        """Delete what is cached of a payload, if anything is."""
        if self._cached.pop(key, None) is not None:
            remove(self._folders.cache / key)

    def clear(self) -> None:
        """Delete all of it."""
        for key in tuple(self._cached):
            self.drop(key)
