"""What was made of payloads that were withdrawn, so that one that comes back is not copied, checked
and linked once more.

    cache/<key>/payload    its checked files but its wheels
    cache/<key>/venvs      its venvs, made again from the store while nothing else is to be done

A starting daemon deletes all of it. What came with pip is not cached: it would take its disk twice.
"""

from __future__ import annotations

import errno
import logging
import os
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from nondum.host.core.keyed_queues import in_thread
from nondum.host.jobs.children import Children
from nondum.host.manager.state_folders import PRIVATE, Folders, move, remove
from nondum.sdk.errors import NondumError
from nondum.sdk.frozen import frozen

CACHED = 8
"""Payloads at most; those that were withdrawn last stay."""

Run = Callable[[dict[str, Any]], Awaitable[dict[str, Any] | None]]

log = logging.getLogger(__name__)


@frozen
class CachedPayload:
    """One of them."""

    folder: Path
    venvs: Path
    told: Mapping[str, Any]
    """What the job `install` told of it."""
    stamp: str = ""
    """Of its files, as the job `fill_cache` left them; "": it is not done."""


class PayloadCache:
    """Payload → what is cached of it. Nothing else may write to the store meanwhile, but during
    `restore`."""

    def __init__(self, folders: Folders, children: Children) -> None:
        self._folders, self._children = folders, children
        self._cached: dict[str, CachedPayload] = {}

    def __contains__(self, key: str) -> bool:
        return key in self._cached

    @property
    def unfilled(self) -> str | None:
        """A payload whose venvs are not made yet; None: there is none."""
        return next((key for key, cached in self._cached.items() if not cached.stamp), None)

    def put(self, key: str, told: Mapping[str, Any]) -> None:
        """Take a payload's checked files. Blocks.

        Raises `OSError`, also where what is in the store cannot be linked: it would be there twice.
        """
        self.drop(key)
        self._folders.cache.mkdir(PRIVATE, exist_ok=True)
        if self._folders.cache.stat().st_dev != self._folders.store.stat().st_dev:
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV), str(self._folders.store))
        root = self._folders.cache / key
        cached = CachedPayload(root / "payload", root / "venvs", told)
        move(self._folders.payload(key), cached.folder)
        self._cached[key] = cached

    async def fill(self, key: str, arguments: Mapping[str, Any]) -> bool:
        """Make a payload's venvs, if it is still away; whether they have been made.

        The oldest payload gives way if there are too many.
        """
        if (cached := self._cached.get(key)) is None or cached.stamp:
            return False
        places = {"folder": str(cached.folder), "venvs": str(cached.venvs)}
        try:
            said = await self._children.run_aside("fill_cache", {**arguments, **places})
        except NondumError as error:
            log.info("%s is not cached: %s", key, error)
            await in_thread(self.drop, key)
            return False
        told = {**cached.told, "fresh": 0, "uncompiled": said["uncompiled"]}
        del self._cached[key]
        self._cached[key] = replace(cached, told=told, stamp=said["stamp"])
        if len(self._cached) > CACHED:
            await in_thread(self.drop, next(iter(self._cached)))
        return True

    def told_of(self, key: str) -> Mapping[str, Any] | None:
        """What `install` told of a payload whose venvs are made."""
        cached = self._cached.get(key)
        return cached.told if cached and cached.stamp else None

    async def restore(
        self, key: str, run: Run, arguments: Mapping[str, Any], staging: Path
    ) -> dict[str, Any] | None:
        """Move a payload's files to staging, its venvs where workers find them, once it is judged
        as if it were copied: what `install` would tell, and the `known` bytes.

        None: it is not as it was, and deleted. `run` does the job; if it fails, all stays cached.
        Raises what that does, and `OSError`.
        """
        cached = self._cached.pop(key)  # so that it gives way to none meanwhile
        places = {"cached_folder": str(cached.folder), "cached_venvs": str(cached.venvs)}
        try:
            told = await run({**arguments, **places, "stamp": cached.stamp})
        except BaseException:
            self._cached[key] = cached
            raise
        if told is not None:
            await in_thread(move, cached.folder, staging)
            await in_thread(move, cached.venvs, self._folders.venvs(key))
        await in_thread(remove, self._folders.cache / key)
        return None if told is None else {**cached.told, **told}

    def drop(self, key: str) -> None:
        """Delete what is cached of a payload, if anything is. Blocks."""
        if self._cached.pop(key, None) is not None:
            remove(self._folders.cache / key)

    def clear(self) -> None:
        """Delete all of it. Blocks."""
        for key in tuple(self._cached):
            self.drop(key)
