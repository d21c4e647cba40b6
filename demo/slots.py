"""Device slots: the folder of TOML files that stands for udev where instruments are emulated.

Each file says what udev would say of the USB adapter that the instrument comes with.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

COMPTON_CAMERA = {
    "SUBSYSTEM": "tty",
    "ID_BUS": "usb",
    "ID_VENDOR_ID": "0403",
    "ID_MODEL_ID": "6014",
    "ID_VENDOR": "FTDI",
    "ID_MODEL": "Compton_List_Mode_Camera",
    "ID_SERIAL": "FTDI_Compton_List_Mode_Camera_CC000417",
}
PAN_TILT_UNIT = {
    "SUBSYSTEM": "tty",
    "ID_BUS": "usb",
    "ID_VENDOR_ID": "0403",
    "ID_MODEL_ID": "6001",
    "ID_VENDOR": "FTDI",
    "ID_MODEL": "PTU-D46-17",
    "ID_SERIAL": "FTDI_PTU-D46-17_PT004233",
}
LASER_RELAY = {
    "SUBSYSTEM": "tty",
    "ID_BUS": "usb",
    "ID_VENDOR_ID": "1a86",
    "ID_MODEL_ID": "7523",
    "ID_VENDOR": "1a86",
    "ID_MODEL": "USB_Serial",
    "ID_SERIAL": "1a86_USB_Serial",
}


def plug(folder: Path, name: str, node: str, properties: Mapping[str, str]) -> Path:
    """Make a device appear: write its slot file, at once and whole. Returns the file."""
    unfinished = folder / f".{name}.part"
    unfinished.write_text(entry(node, properties), encoding="utf-8")
    return unfinished.replace(folder / f"{name}.toml")


def unplug(folder: Path, name: str) -> None:
    """Make it disappear."""
    (folder / f"{name}.toml").unlink()


def entry(node: str, properties: Mapping[str, str]) -> str:
    """The text of a slot file.

    >>> print(entry("/dev/pts/3", {"ID_BUS": "usb"}), end="")
    [device]
    node = "/dev/pts/3"
    [device.properties]
    ID_BUS = "usb"
    """
    lines = [f'{key} = "{value}"' for key, value in properties.items()]
    return "\n".join(["[device]", f'node = "{node}"', "[device.properties]", *lines, ""])
