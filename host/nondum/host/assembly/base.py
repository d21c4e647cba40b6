"""What every part of a host may be made with."""

from __future__ import annotations

import os

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
    def keeps_ready(self) -> bool:
        """Whether processes are kept ready for what may be plugged in or wanted next."""
        memory_mb = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2**20
        return memory_mb > self.config.host.keep_ready_above_mb
