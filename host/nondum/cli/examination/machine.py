"""The machine: its kernel's cgroups, udev, USB and sound."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from nondum.cli.examination.finding import Finding, bad, ok, warn
from nondum.host.config.host_config import HostConfig

CGROUPS = Path("/sys/fs/cgroup")
WANTED = ("memory", "pids", "cpu")
UDEV = Path("/run/udev/control")
USB = Path("/sys/bus/usb/devices")
SOUND = Path("/proc/asound/cards")
_ON_A_PI = (
    "add `cgroup_enable=memory cgroup_memory=1` to the kernel's command line "
    "(/boot/firmware/cmdline.txt), and restart the machine"
)


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look at the kernel and the buses."""
    yield judge_cgroups(_controllers(CGROUPS))
    yield judge_udev(is_there=UDEV.exists(), is_wanted=config.devices.udev)
    yield judge_usb(_names(USB), is_wanted=config.drives.block_devices)
    yield judge_sound(_text(SOUND))


def judge_cgroups(controllers: Collection[str] | None) -> Finding:
    """Whether workers can be held to what they may use; None: there is no version 2. Pure."""
    if controllers is None:
        told = "there are no control groups of version 2: workers are held by each process's limits"
        return warn("cgroups", told, "start the machine with systemd.unified_cgroup_hierarchy=1")
    missing = [name for name in WANTED if name not in controllers]
    if not missing:
        return ok("cgroups", f"version 2, with {', '.join(WANTED)}")
    fix = _ON_A_PI if missing == ["memory"] else "use a kernel that has them"
    return warn("cgroups", f"version 2, without {', '.join(missing)}", fix)


def judge_udev(*, is_there: bool, is_wanted: bool) -> Finding:
    """Whether anybody tells of what is plugged in. Pure."""
    if is_there:
        return ok("udev", "it runs")
    if not is_wanted:
        return ok("udev", "it does not run, and is not asked for (`devices.udev`)")
    told = "it does not run: the host does not learn which devices are plugged in"
    return bad("udev", told, "start systemd-udevd, or set `udev = false` under [devices]")


def judge_usb(names: Collection[str], *, is_wanted: bool) -> Finding:
    """Whether drives and instruments can be plugged in. Pure."""
    buses = sum(name.startswith("usb") for name in names)
    plugged = sum(name[:1].isdigit() and ":" not in name for name in names)
    if buses:
        return ok("USB", f"{buses} buses, {plugged} things plugged in")
    told = "there is no USB bus: drives cannot be plugged in"
    fix = "look at `lspci` and `dmesg`; in a virtual machine, give it a controller"
    return warn("USB", told, fix) if is_wanted else ok("USB", "none, and none is asked for")


def judge_sound(cards: str) -> Finding:
    """Whether the robot can be heard. Pure."""
    names = [line.split(" - ")[-1] for line in cards.splitlines() if " - " in line]
    if names:
        return ok("sound", ", ".join(names))
    told = "there is no sound card: the robot cannot speak by itself"
    return warn("sound", told, "plug one in, or do without: nothing else needs it")


def _controllers(root: Path) -> Collection[str] | None:
    text = _text(root / "cgroup.controllers")
    return text.split() if text else None


def _names(folder: Path) -> Collection[str]:
    try:
        return [path.name for path in folder.iterdir()]
    except OSError:
        return ()


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
