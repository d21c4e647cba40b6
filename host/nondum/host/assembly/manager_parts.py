"""Makes the component manager and its effect handlers, with the options of installing."""

from __future__ import annotations

import os
from collections.abc import Iterable

from nondum.host.assembly.base import Base
from nondum.host.config.host_config import WorkersSection
from nondum.host.core.records.safety import Safety
from nondum.host.manager.component_manager import ComponentManager
from nondum.host.manager.effect_handlers import Executor
from nondum.host.manager.install_options import InstallOptions
from nondum.host.manager.payload_trust import TrustOptions
from nondum.host.sources.drives.source import DriveSource
from nondum.host.workers.spec import Limits
from nondum.host.workers.workers import Workers
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.limits import WorkerLimits


@frozen
class ManagerParts:
    """The component manager and what carries out its effects."""

    manager: ComponentManager
    executor: Executor


def make_manager(
    base: Base, workers: Workers, safety: tuple[Safety, str], drives: Iterable[DriveSource]
) -> ManagerParts:
    """Make the component manager of these drives; `safety` is which payloads it leaves alone, and
    why."""
    options, bus = _install_options(base), base.bus
    executor = Executor(base.config.host.name, base.folders, workers, bus.emit, options)
    manager = ComponentManager(base.catalogue, executor, bus)
    manager.leave_alone(*safety)
    for source in drives:
        manager.add_source(source)
    return ManagerParts(manager, executor)


def _install_options(base: Base) -> InstallOptions:
    config = base.config
    return InstallOptions(
        allow_unsigned=config.drives.allow_unsigned,
        look_s=config.drives.look_s,
        trust=TrustOptions(config.first_trust_file, stop=config.trust.on_revoke == "stop"),
        method=config.install.method,
        reserve_mb=config.install.reserve_mb,
        quota_mb=config.install.quota_mb,
        forks_stay=base.forks_stay,
        limits=Limits(
            memory_mb=config.workers.memory_mb,
            tasks=config.workers.tasks,
            descriptors=config.workers.descriptors,
            processors=config.workers.cpu_percent / 100,
            scratch_mb=config.workers.scratch_mb,
        ),
        most=_most(config.workers),
        settings=config.workers.settings,
    )


def _most(workers: WorkersSection) -> WorkerLimits:
    """The most that a worker may ask for."""
    return WorkerLimits(
        memory_mb=workers.most_memory_mb or None,
        tasks=workers.most_tasks,
        numeric_threads=workers.most_numeric_threads or os.cpu_count(),
        startup_s=workers.most_startup_s,
        scratch_mb=workers.most_scratch_mb,
    )
