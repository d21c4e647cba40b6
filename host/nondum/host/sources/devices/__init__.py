"""Devices: where they come from. Which component gets which one is the component manager's."""

from nondum.host.sources.devices.slots import DeviceSlotSource
from nondum.host.sources.devices.source import DeviceSource
from nondum.host.sources.devices.udev import UdevSource

__all__ = ["DeviceSlotSource", "DeviceSource", "UdevSource"]
