"""Makes what runs workers: their confinement, their cgroups, and the workers themselves."""

from __future__ import annotations

import logging

from nondum.host.assembly.base import Base
from nondum.host.config.confinement_level import ConfinementState
from nondum.host.core.keyed_queues import in_thread
from nondum.host.manager.state_folders import Folders, let_pass
from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.sandbox.helper import privileged
from nondum.host.workers import confinement_choice
from nondum.host.workers.held import changes_user
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spec import Timing
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import NondumError
from nondum.sdk.frozen import frozen

log = logging.getLogger(__name__)


@frozen
class WorkerParts:
    """What runs workers."""

    workers: Workers
    confinement: ConfinementState
    """At which level they are confined, and why."""
    cgroups: Cgroups

    async def close(self) -> None:
        """End all workers, and what holds them."""
        await self.workers.close()
        await in_thread(self.cgroups.close)


async def make_workers(base: Base) -> WorkerParts:
    """Make what runs workers. Raises `ConfigRefused`."""
    section, folders = base.config.workers, base.folders
    timing = Timing(startup_s=section.startup_s, settle_beats=section.settle_beats)
    cgroups = await in_thread(_cgroups, folders)
    state = await in_thread(
        confinement_choice.confinement_state,
        section.confinement,
        section.minimum_confinement,
        folders.confinement,
        folders.probes,
    )
    confinement = confinement_choice.confinement(state, folders.of_workers)
    if changes_user(confinement):
        await in_thread(let_pass, folders)
    launcher = WorkerLauncher(confinement, cgroups, folders.scratches, timing.startup_s)
    workers = Workers(base.config.host.name, base.bus.emit, launcher=launcher, timing=timing)
    return WorkerParts(workers, state, cgroups)


def _cgroups(folders: Folders) -> Cgroups:
    """Cgroups of workers, made by this process or the helper. The last daemon's are ended."""
    cgroups = Cgroups.open(folders.root)
    if not cgroups.holds:
        try:
            cgroups = Cgroups(privileged().cgroups())
        except NondumError as error:
            log.warning("%s", error)
    cgroups.sweep()
    return cgroups
