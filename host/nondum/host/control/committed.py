"""Waits until the catalogue has what was asked for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.news import News
from nondum.host.core.records.snapshot import Snapshot
from nondum.sdk.errors import InstallFailed, Problem

COMMIT_TIMEOUT_S = 5.0


async def until_committed(
    catalogue: Catalogue, news: News, holds: Callable[[Snapshot], bool]
) -> None:
    """Wait until what was asked for has been committed.

    Raises `InstallFailed` (CATALOGUE_BUSY) after a few seconds.
    """
    version = news.version
    try:
        async with asyncio.timeout(COMMIT_TIMEOUT_S):
            while not holds(catalogue.snapshot()):
                version = await news.changed(version)
    except TimeoutError as error:
        text = "it was not committed to the catalogue in time"
        fix = "see the daemon's own log: is the disk full?"
        raise InstallFailed(Problem("CATALOGUE_BUSY", text, fix=fix)) from error
