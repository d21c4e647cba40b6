"""Which disk is used by what: tells people why a disk is read as a drive, or is not."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from pathlib import Path

from nondum.host.sandbox.helper.block_devices import Machine
from nondum.host.sandbox.helper.system_disks import Use
from nondum.sdk.frozen import frozen

SECTOR = 512
"""What sysfs counts sizes in, whatever the disk does."""

_FREE = Use("nothing else uses it", is_own=False)
_FIXED = Use("it does not hang on USB")
_DIVIDED = "each of its partitions is a drive"


class Owner(Enum):
    """Who has a block device."""

    HOST = "host"
    """The machine itself: never touched."""
    SOMEBODY = "somebody"
    """Another user or program, which mounted it: not read as long as it is mounted."""
    DRIVE = "drive"
    """This host reads it as a drive."""
    NONE = ""
    """It is no drive as a whole: its partitions may be."""


@frozen
class Disk:
    """A disk or partition."""

    name: str
    size: int
    """Bytes."""
    is_usb: bool
    owner: Owner
    why: str


def disks(machine: Machine, ours: Path) -> Iterator[Disk]:
    """All that hold something, by name; `ours` is where drives are mounted to be read."""
    uses, blocks = machine.uses(ours), machine.blocks()
    divided = {block.disk for block in blocks if block.disk != block.name}
    for block in blocks:
        if size := machine.sectors(block.name):
            is_usb = machine.is_on_usb(block.name)
            use = uses.get(block.name) or (_FREE if is_usb else _FIXED)
            owner, why = Owner.HOST if use.is_own or not is_usb else Owner.SOMEBODY, use.why
            if use is _FREE:
                is_divided = block.name in divided
                owner, why = (Owner.NONE, _DIVIDED) if is_divided else (Owner.DRIVE, use.why)
            yield Disk(block.name, size * SECTOR, is_usb, owner, why)
