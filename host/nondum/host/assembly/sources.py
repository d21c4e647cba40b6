"""Makes the sources of drives and devices, as the configuration asks for them."""

from __future__ import annotations

from collections.abc import Iterable

from nondum.host.config.host_config import HostConfig
from nondum.host.manager.state_folders import Folders
from nondum.host.sandbox.helper import privileged
from nondum.host.sources.devices.slots import DeviceSlotSource
from nondum.host.sources.devices.source import DeviceSource
from nondum.host.sources.devices.udev import UdevSource
from nondum.host.sources.drives.blocks import BlockSource
from nondum.host.sources.drives.debounce import Debounced
from nondum.host.sources.drives.slots import SlotSource
from nondum.host.sources.drives.source import DriveSource
from nondum.sdk.errors import ConfigRefused, Problem
from nondum.sdk.frozen import frozen


@frozen
class Sources:
    """Where this host's drives and devices come from."""

    drives: tuple[DriveSource, ...]
    devices: tuple[DeviceSource, ...]

    def problems(self) -> tuple[Problem, ...]:
        """What is wrong in all slot folders."""
        return (*_slot_problems(self.drives), *_slot_problems(self.devices))

    def device_problems(self) -> tuple[Problem, ...]:
        """What is wrong in those of devices."""
        return _slot_problems(self.devices)


def make_sources(config: HostConfig, folders: Folders) -> Sources:
    """Make all sources; none looks yet."""
    drives: list[DriveSource] = []
    if config.drives.slots:
        drives.append(SlotSource(config.drives.slots))
    if config.drives.block_devices:
        single_function = config.drives.single_function
        mounts = privileged().mounts(folders.mounts)
        drives.append(Debounced(BlockSource(mounts, single_function=single_function)))
    devices: list[DeviceSource] = []
    if config.devices.slots:
        devices.append(DeviceSlotSource(config.devices.slots))
    if config.devices.udev:
        devices.append(UdevSource())
    return Sources(tuple(drives), tuple(devices))


def make_slot_folders(config: HostConfig) -> None:
    """Make the folders that are watched. Raises `ConfigRefused` (CONFIG_FOLDER)."""
    problems = []
    for section in ("drives", "devices"):
        for folder in getattr(config, section).slots:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                text = f"cannot be a folder of slots ({error.strerror})"
                fix = f"see `slots` under [{section}]"
                problems.append(Problem("CONFIG_FOLDER", text, where=str(folder), fix=fix))
    if problems:
        raise ConfigRefused(*problems)


def _slot_problems(sources: Iterable[DriveSource | DeviceSource]) -> tuple[Problem, ...]:
    """What is wrong in the slot folders among some sources."""
    slots = (one for one in sources if isinstance(one, SlotSource | DeviceSlotSource))
    return tuple(problem for one in slots for problem in one.problems)
