"""Nodes of devices that components were granted: a folder for each, on a separate file system.

/run may hold no devices (`nodev`), so the folder is a small tmpfs; only the owner of a node opens
it.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import stat
from pathlib import Path

from nondum.host.sandbox.helper.requests import refused
from nondum.sdk.errors import NondumError
from nondum.sdk.frozen import frozen

SYS = Path("/sys")
SIZE = "size=256k,nr_inodes=4096,mode=0755"
MS_NOSUID, MS_NOEXEC = 0x2, 0x8
_RAW = frozenset({"scsi_generic", "bsg", "nvme", "nvme-generic"})
"""Subsystems whose nodes give away whole disks."""
KEYBOARD = ("03", "01")
"""Interface class and protocol (USB HID 1.11, 4.2); no component may read what people type."""
_ENTER = 28
_LETTERS = (*range(16, 26), *range(30, 39), *range(44, 51))
"""From Q to P, from A to L, from Z to M."""
_WORD = 8 * ctypes.sizeof(ctypes.c_ulong)
"""Bits of a word in sysfs' bitmaps."""
HUB = "09"
STORAGE = "08"


@frozen
class Nodes:
    """The folders below `base`, whose nodes belong to `uid`, the daemon's, or to a worker's."""

    base: Path
    uid: int
    subsystems: frozenset[str] = frozenset()
    """Those of which devices may be had that do not hang on USB: root's word."""
    sys: Path = SYS

    def put(
        self, component: str, need: str, major: int, minor: int, user: int | None = None
    ) -> Path:
        """Make a node for a device that was plugged in, for a user if not the daemon's.

        Raises `NondumError` (HELPER_REFUSED).
        """
        device = self._identity(major, minor)
        self._check(major, minor)
        self.prepare()
        folder = self.base / component
        folder.mkdir(mode=0o755, exist_ok=True)
        node, fresh = folder / need, folder / f".{need}"
        fresh.unlink(missing_ok=True)
        os.mknod(fresh, stat.S_IFCHR | 0o600, os.makedev(major, minor))
        os.chown(fresh, self.uid if user is None else user, -1)
        fresh.rename(node)  # atomic: a reader finds the old node or the new one
        if self._identity(major, minor) != device:  # pulled meanwhile: its removal may be past
            node.unlink(missing_ok=True)
            raise refused("there is no such device", f"{major}:{minor}")
        return node

    def drop(self, major: int, minor: int) -> None:
        """Remove all nodes of a device that has gone: its number may be another one's next."""
        for node in self._made():
            if _number(node) == (major, minor):
                node.unlink(missing_ok=True)

    def drop_unfit(self) -> None:
        """Remove all nodes whose number is not a device's any more that may be given, and those of
        which that cannot be told: what sysfs shows of a device can go while it is looked at."""
        for node in self._made():
            try:
                self._check(*_number(node))
            except (NondumError, OSError):
                node.unlink(missing_ok=True)

    @property
    def are_there(self) -> bool:
        """Whether there is any node."""
        return bool(self._made())

    def take(self, component: str, need: str) -> None:
        """Remove a node; none there is fine."""
        (self.base / component / need).unlink(missing_ok=True)

    def clear(self, component: str) -> None:
        """Remove all nodes of a component; of all where that is empty."""
        if not self.base.is_dir():
            return
        for folder in (self.base / component,) if component else tuple(self.base.iterdir()):
            with contextlib.suppress(FileNotFoundError):
                for node in tuple(folder.iterdir()):
                    node.unlink(missing_ok=True)
                folder.rmdir()

    def _made(self) -> list[Path]:
        """All nodes. Other processes of the helper make and remove them, and their folders."""
        made: list[Path] = []
        for folder in self.base.iterdir() if self.base.is_dir() else ():
            with contextlib.suppress(FileNotFoundError):
                made += folder.iterdir()
        return made

    def _identity(self, major: int, minor: int) -> int | None:
        """Of the device that has a number now: sysfs gives no two folders one inode."""
        try:
            return (self.sys / "dev/char" / f"{major}:{minor}").stat().st_ino
        except OSError:
            return None

    def _check(self, major: int, minor: int) -> None:
        link = self.sys / "dev/char" / f"{major}:{minor}"
        if not link.exists():
            raise refused("there is no such device", f"{major}:{minor}")
        device = link.resolve()
        subsystem = (device / "subsystem").resolve().name
        is_hub = _attribute(device, "bDeviceClass") == HUB
        if (
            subsystem in _RAW
            or is_hub
            or _is_keyboard(device)
            or _types(device, subsystem)
            or _is_drive(device)
        ):
            raise refused("a component is not given disks, keyboards or hubs", f"{major}:{minor}")
        if not _usb(device) and subsystem not in self.subsystems:
            raise refused("it does not hang on USB", f"{major}:{minor}")

    def prepare(self) -> None:
        """Have the folder that the others are in, on a file system that may hold nodes."""
        self.base.mkdir(mode=0o755, parents=True, exist_ok=True)
        if not os.statvfs(self.base).f_flag & os.ST_NODEV:
            return
        libc = ctypes.CDLL(None, use_errno=True)
        flags = ctypes.c_ulong(MS_NOSUID | MS_NOEXEC)
        if libc.mount(b"nondum", os.fsencode(self.base), b"tmpfs", flags, SIZE.encode()) != 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(self.base))


def _usb(device: Path) -> tuple[Path, ...]:
    """The device and what it hangs on, as far as the bus's own top; none: not on USB."""
    line = (device, *device.parents)
    tops = [n for n, at in enumerate(line) if at.name.startswith("usb") and at.name[3:].isdigit()]
    return line[: tops[0]] if tops else ()


def _is_keyboard(device: Path) -> bool:
    """Whether it, an interface that it hangs on, or one that it has, is a keyboard."""
    interfaces = (*_usb(device), *device.glob("*:*"))
    return any(
        (_attribute(at, "bInterfaceClass"), _attribute(at, "bInterfaceProtocol")) == KEYBOARD
        for at in interfaces
    )


def _types(device: Path, subsystem: str) -> bool:
    """Whether an input device that it is of, or that is of its interface, has letters and Enter.

    A keyboard without the boot interface declares no protocol (bInterfaceProtocol). An input node
    tells of its input device only; other nodes may tell all that comes from their interface.
    """
    if subsystem == "input":
        return _has_letters(device.parent)
    line = _usb(device)
    interface = next((at for at in line if ":" in at.name and at.parent in line), None)
    above = interface if interface is not None else device
    return any(_has_letters(at.parent.parent) for at in above.rglob("capabilities/key"))


def _has_letters(device: Path) -> bool:
    """By the keys that its input driver tells (input-event-codes.h), in words, highest first."""
    words = _attribute(device, "capabilities/key").split()
    bits = 0
    try:
        for word in words:
            bits = bits << _WORD | int(word, 16)
    except ValueError:
        return True  # unknown
    return bool(bits >> _ENTER & 1 and any(bits >> letter & 1 for letter in _LETTERS))


def _number(node: Path) -> tuple[int, int]:
    """The device of a node, or (0, 0), which is none."""
    try:
        device = node.lstat().st_rdev
    except FileNotFoundError:
        return 0, 0
    return os.major(device), os.minor(device)


def _is_drive(device: Path) -> bool:
    """Whether an interface that it hangs on, or one that it has, is a drive's."""
    interfaces = (*_usb(device), *device.glob("*:*"))
    return any(_attribute(at, "bInterfaceClass") == STORAGE for at in interfaces)


def _attribute(device: Path, name: str) -> str:
    try:
        return (device / name).read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""
