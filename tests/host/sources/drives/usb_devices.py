"""USB devices as sysfs shows them."""

from __future__ import annotations

from pathlib import Path


def stick(root: Path, *classes: str) -> Path:
    """The block device's folder of a USB device with interfaces of these classes, in a sysfs."""
    device = root / "devices/pci0000:00/0000:00:14.0/usb1/1-1"
    for number, name in enumerate(classes):
        interface = device / f"1-1:1.{number}"
        interface.mkdir(parents=True)
        (interface / "bInterfaceClass").write_text(f"{name}\n")
    (device / "bDeviceClass").write_text("00\n")
    block = device / "1-1:1.0/host6/target6:0:0/6:0:0:0/block/sdb"
    block.mkdir(parents=True)
    return block
