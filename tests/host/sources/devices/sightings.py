"""Devices as tests make them up: parts of sysfs as udev tells of them, and events of what comes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nondum.host.core.events.devices import DeviceAppeared
from nondum.host.core.records.device import DeviceNode, DeviceRecord
from nondum.host.sources.devices.hardware import Part, described

BUS = "/devices/pci0000:00/0000:00:04.0/usb1"


def appeared(device: str, *nodes: str, **properties: str) -> DeviceAppeared:
    """A device of one slot file, or of one that is told like it."""
    made = tuple(DeviceNode(Path(node), properties) for node in nodes)
    return DeviceAppeared(device, DeviceRecord(device, made, port=device, **described(properties)))


def usb(port: str = "1-4", **properties: str) -> Part:
    """A USB device, with its raw node."""
    known: dict[str, str] = {
        **{"SUBSYSTEM": "usb", "DEVTYPE": "usb_device", "MAJOR": "189"},
        **{"DEVNAME": f"/dev/bus/usb/001/{port.rpartition('-')[2].rpartition('.')[2].zfill(3)}"},
        **{"DRIVER": "usb", "ID_VENDOR_ID": "0403", "ID_MODEL_ID": "6001"},
    }
    path = "/".join([BUS, *(port[: i + 1] for i in _hops(port)), port])
    return Part(path, "usb", "usb_device", True, {**known, **properties})


def _hops(port: str) -> list[int]:
    """Ends of the names of the hubs that a port is behind."""
    return [i - 1 for i, sign in enumerate(port) if sign == "."]


def interface(device: Part, number: int, kind: str, driver: str = "") -> Part:
    """One of its interfaces; `kind` as the kernel has it: `14/1/0`."""
    name = device.path.rpartition("/")[2]
    known = {"SUBSYSTEM": "usb", "DEVTYPE": "usb_interface", "INTERFACE": kind}
    if driver:
        known["DRIVER"] = driver
    path = f"{device.path}/{name}:1.{number}"
    return Part(path, "usb", "usb_interface", True, known, device)


def node(above: Part, subsystem: str, name: str, **properties: Any) -> Part:
    """Something with a node, made by the driver of an interface or a device."""
    known = {"SUBSYSTEM": subsystem, "DEVNAME": f"/dev/{name}", **properties}
    path = f"{above.path}/{subsystem}/{name.rpartition('/')[2]}"
    return Part(path, subsystem, "", False, known, above)


def platform(name: str) -> Part:
    """A device of the board."""
    return Part(f"/devices/platform/{name}", "platform", "", True, {"DRIVER": name.split(".")[0]})


def serial_adapter(port: str = "1-4", name: str = "ttyUSB0", **properties: str) -> list[Part]:
    """A USB serial adapter and its line, as udev tells of them."""
    device = usb(port, **properties)
    line = interface(device, 0, "255/255/255", "ftdi_sio")
    return [device, line, node(line, "tty", name)]


def camera_with_microphone(port: str = "1-2") -> list[Part]:
    """A composite device: two nodes of video on one interface, three of sound on another."""
    device = usb(port, ID_VENDOR_ID="046d", ID_MODEL_ID="0825", ID_SERIAL_SHORT="CAFE")
    video = interface(device, 0, "14/1/0", "uvcvideo")
    sound = interface(device, 2, "1/1/0", "snd-usb-audio")
    return [
        *(device, video, sound),
        *(node(video, "video4linux", "video0"), node(video, "video4linux", "video1")),
        *(node(sound, "sound", "snd/controlC1"), node(sound, "sound", "snd/pcmC1D0c")),
    ]
