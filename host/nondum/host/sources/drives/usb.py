"""What a USB device is beside a drive: a stick that is a keyboard too types what its maker likes.

sysfs shows a device's interfaces as folders in it (Documentation/ABI/stable/sysfs-bus-usb); their
classes are those of usb.org. What hangs on a hub that is built in is another device there, and
cannot be told from what a person plugged in beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from nondum.sdk.errors import Problem

MASS_STORAGE = "08"
_NAMES: Mapping[str, str] = {
    "01": "audio",
    "02": "modem or network",
    "03": "keyboard, mouse or other input",
    "06": "camera",
    "07": "printer",
    "0a": "modem or network data",
    "0b": "smart card",
    "0e": "video",
    "e0": "wireless",
    "ef": "miscellaneous",
    "ff": "the maker's own",
}


def extra_interfaces(block: Path, where: str) -> tuple[Problem, ...]:
    """What a block device's USB device is beside a drive (USB_EXTRA_INTERFACE); nothing: it is a
    drive only, or not on USB. `block` is its folder in sysfs."""
    found = sorted({cls for cls in _classes(block) if cls != MASS_STORAGE})
    if not found:
        return ()
    shown = ", ".join(f"{cls} ({_NAMES.get(cls, 'unknown')})" for cls in found)
    return (
        Problem(
            "USB_EXTRA_INTERFACE",
            "the drive is another kind of device too, and is not read",
            where=where,
            need=f"mass storage ({MASS_STORAGE}) only",
            have=f"bInterfaceClass {shown}",
            fix="use a plain USB stick; throw this one away if you do not know whose it is",
        ),
    )


def _classes(block: Path) -> Iterator[str]:
    """The classes of all interfaces of the USB device that a block device hangs on."""
    device = next((p for p in block.resolve().parents if (p / "bDeviceClass").is_file()), None)
    for interface in sorted(device.glob("*:*/bInterfaceClass")) if device else ():
        yield interface.read_text(encoding="ascii").strip()


def port_of(block: Path) -> str:
    """The port that a block device hangs on: whatever is plugged in there has the same; its own
    name where it is not on USB.

    >>> port_of(Path("/sys/devices/pci0/usb1/1-1/1-1.4/1-1.4:1.0/host2/block/sda/sda1"))
    '1-1.4'
    """
    usb = [p.name for p in block.parents if p.name[:1].isdigit() and "-" in p.name]
    ports = [name for name in usb if ":" not in name]
    return ports[0] if ports else block.name
