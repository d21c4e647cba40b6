"""Devices: where they come from. Which component gets which one is the component manager's."""

from nondum.host.devices.slots import DeviceSlotSource
from nondum.host.devices.source import DeviceSource
from nondum.host.devices.udev import UdevSource

__all__ = ["DeviceSlotSource", "DeviceSource", "UdevSource"]
