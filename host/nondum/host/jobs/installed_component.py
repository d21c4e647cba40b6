"""One component of a payload whose venv is made, as the job `install` tells of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nondum.sdk.description import DeviceNeed, PluginDescription
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.data import DataNeed
from nondum.wheelhouse.format.limits import WorkerLimits
from nondum.wheelhouse.format.manifest import UnitMount


@frozen
class InstalledComponent:
    """What its worker can be started from; a child process tells it, and the daemon reads it."""

    id: str
    """Its name in the payload."""
    distribution: str
    entry_point: str
    description: PluginDescription
    venv: Path
    site_packages: Path
    permissions: tuple[str, ...]
    settings: Mapping[str, Any]
    devices: tuple[DeviceNeed, ...]
    units: tuple[UnitMount, ...]
    """Where units sit, as the manifest says."""
    limits: WorkerLimits
    """What it is granted instead of what the host gives each worker."""
    data: tuple[DataNeed, ...]
