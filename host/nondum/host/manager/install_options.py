"""How payloads are judged and installed on a host, as its configuration says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from pathlib import Path

from nondum.host.manager.drive_reading import LOOK_S
from nondum.host.manager.payload_trust import TrustOptions
from nondum.host.workers.spec import Limits
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.limits import WorkerLimits


@frozen
class InstallOptions:
    """How payloads are judged and installed on this host."""

    allow_unsigned: bool = False
    look_s: float = LOOK_S
    """A drive that cannot be mounted and listed in this time hangs."""
    method: str = "store"
    """`store`: links to the store. `pip`: pip itself."""
    reserve_mb: int = 64
    """Disk that is left free."""
    quota_mb: int = 4096
    """Size that the store is pruned to."""
    forks_stay: Callable[[], bool] | None = None
    """Whether what children are forked from stays when none of them runs; None: always."""
    limits: Limits = field(default_factory=Limits)
    """Of each worker that asks for no others."""
    most: WorkerLimits = field(default_factory=WorkerLimits)
    """The most that a worker may ask for."""
    settings: Path | None = None
    """File with settings of components, over those of their payloads."""
    trust: TrustOptions = field(default_factory=TrustOptions)
