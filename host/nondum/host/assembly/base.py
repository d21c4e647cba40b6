"""What every part of a host may be made with."""

from __future__ import annotations

import os
from collections.abc import Callable

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.host_config import HostConfig
from nondum.host.core.bus import Bus
from nondum.host.extension.loading import Extensions
from nondum.host.manager.crash_loop import CrashCounter
from nondum.host.manager.state_folders import Folders
from nondum.host.service.service import Service
from nondum.sdk.frozen import frozen


@frozen
class Base:
    """What is there before any part: configuration, state, bus, extensions, service manager."""

    config: HostConfig
    folders: Folders
    catalogue: Catalogue
    bus: Bus
    extensions: Extensions
    service: Service
    counter: CrashCounter

    @property
    def forks_stay(self) -> Callable[[], bool] | None:
        """Whether what processes are forked from stays when none of them runs; None: always.

        On a machine with little memory it does while a goal is given or another host is there: what
        is wanted next cannot wait for an interpreter then.
        """
        memory_mb = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2**20
        if memory_mb > self.config.host.keep_ready_above_mb:
            return None
        return lambda: self.catalogue.state.is_at_work
