"""What the kernel says of a machine: each function reads below `root`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

UNKNOWN = "not known"
_MODELS = ("model name", "Model", "Hardware")
_PART = ("CPU implementer", "CPU part")


def model(root: Path) -> str:
    """The board: the device tree's model, or what the firmware of a PC says."""
    if tree := _text(root / "proc/device-tree/model"):
        return tree
    firmware = root / "sys/class/dmi/id"
    said = (_text(firmware / name) for name in ("sys_vendor", "product_name"))
    return " ".join(filter(None, said)) or UNKNOWN


def processors(root: Path) -> str:
    """How many, which, and how fast at most; by number where the kernel has no name for them."""
    text = _text(root / "proc/cpuinfo")
    count = len(re.findall(r"^processor\s*:", text, re.MULTILINE))
    named = [found for name in _MODELS if (found := _field(text, name))]
    numbered = [f"{name} {found}" for name in _PART if (found := _field(text, name))]
    which = named[0] if named else ", ".join(numbered) or UNKNOWN
    most_khz = _text(root / "sys/devices/system/cpu/cpu0/cpufreq/cpuinfo_max_freq")
    speed = f", up to {int(most_khz) // 1000} MHz" if most_khz.isdecimal() else ""
    return f"{count} × {which}{speed}"


def memory(root: Path) -> str:
    """All of it, and what there is to swap to."""
    text = _text(root / "proc/meminfo")
    total, swap = (_megabytes(_field(text, name)) for name in ("MemTotal", "SwapTotal"))
    return f"{total} MB, swap {swap} MB"


def system(root: Path) -> str:
    """The distribution, as it calls itself."""
    found = re.search(r'^PRETTY_NAME="?([^"\n]+)', _text(root / "etc/os-release"), re.MULTILINE)
    return found[1] if found else UNKNOWN


def usb_buses(root: Path) -> str:
    """Each bus: its speed, and the driver of its controller."""
    folder = root / "sys/bus/usb/devices"
    return "; ".join(map(_bus, sorted(_children(folder, "usb*")))) or "none"


def _bus(bus: Path) -> str:
    driver = (bus.resolve().parent / "driver").resolve().name
    return f"{bus.name}: {_text(bus / 'speed') or '?'} Mbit/s, {driver}"


def graphics(root: Path) -> str:
    """The drivers of the graphics devices."""
    cards = _children(root / "sys/class/drm", "card[0-9]")
    drivers = {(card / "device/driver").resolve().name for card in cards}
    return ", ".join(sorted(drivers)) or "none"


def real_time_clock(root: Path) -> str:
    """The clock that goes on while power is off."""
    names = [_text(path / "name") for path in _children(root / "sys/class/rtc", "rtc*")]
    return ", ".join(names) or "none: the time stands still while power is off"


def temperature(root: Path) -> str:
    """Of the hottest place."""
    zones = _children(root / "sys/class/thermal", "thermal_zone*")
    told = [_text(zone / "temp") for zone in zones]
    degrees = [int(one) / 1000 for one in told if one.lstrip("-").isdecimal()]
    return f"{max(degrees):.0f} °C" if degrees else UNKNOWN


def disk(root: Path, device: tuple[int, int]) -> str:
    """What a file system is on, by its device's numbers: a card, a stick, a disk."""
    block = root / f"sys/dev/block/{device[0]}:{device[1]}"
    if not block.exists():
        return "no block device"
    whole = block.resolve()
    if (whole / "partition").exists():
        whole = whole.parent
    made = (_text(whole / "device" / name) for name in ("type", "vendor", "model", "name"))
    size = _text(whole / "size")
    told = [whole.name, *filter(None, made)]
    if size.isdecimal():
        told.append(f"{int(size) * 512 / 1e9:.0f} GB")
    return ", ".join(told)


def file_system(root: Path, device: tuple[int, int]) -> str:
    """The type of the file system with these numbers, and how it is mounted."""
    for line in _text(root / "proc/self/mountinfo").splitlines():
        fields, _, kind = line.partition(" - ")
        if fields.split(" ")[2:3] == [f"{device[0]}:{device[1]}"]:
            return f"{kind.split(' ')[0]} ({fields.split(' ')[5]})"
    return UNKNOWN


def _children(folder: Path, pattern: str) -> Iterator[Path]:
    return folder.glob(pattern) if folder.is_dir() else iter(())


def _field(text: str, name: str) -> str:
    found = re.search(rf"^{re.escape(name)}\s*:\s*(.+)$", text, re.MULTILINE)
    return found[1].strip() if found else ""


def _megabytes(told: str) -> int:
    number = told.partition(" ")[0]
    return int(number) // 1024 if number.isdecimal() else 0


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip("\0 \n")
    except OSError:
        return ""
