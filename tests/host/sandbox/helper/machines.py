"""A machine's files about its disks, in a folder."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path

from nondum.host.sandbox.helper.block_devices import Machine as Places
from nondum.host.sandbox.helper.disks import Disks

NUMBER = (8, 17)
USB = "devices/pci0000:00/0000:00:14.0/usb1/1-2/1-2:1.0/host6/target6:0:0/6:0:0:0/block/sdb"
SATA = "devices/pci0000:00/0000:00:17.0/ata1/host0/target0:0:0/0:0:0:0/block/sdb"


@dataclass
class Machine:
    """A machine's /sys, /proc, /dev and fstab, with one disk in it."""

    root: Path
    disk: Path

    @property
    def disks(self) -> Disks:
        root = self.root
        return Disks(machine=Places(root / "sys", root / "proc", root / "dev", root / "etc"))

    def judge(self, device: str = "sdb1", diskseq: int | None = 7) -> Path:
        return self.disks.node(device, diskseq, ours=Path("/run/nondum/mounts"))


def machine(root: Path, place: str = USB) -> Machine:
    """One with a partition `sdb1` of a disk that hangs at a place."""
    disk = root / "sys" / place
    (disk / "sdb1/holders").mkdir(parents=True)
    (disk / "diskseq").write_text("7\n")
    (disk / "dev").write_text("8:16\n")
    (disk / "sdb1/dev").write_text("8:17\n")
    (disk / "sdb1/partition").write_text("1\n")
    links = root / "sys/class/block"
    links.mkdir(parents=True)
    (links / "sdb").symlink_to(disk)
    (links / "sdb1").symlink_to(disk / "sdb1")
    (root / "proc/self").mkdir(parents=True)
    (root / "proc/self/mountinfo").write_text("22 1 8:1 / / rw - ext4 /dev/sda1 rw\n")
    (root / "proc/swaps").write_text("Filename Type Size Used Priority\n")
    (root / "etc").mkdir()
    (root / "etc/fstab").write_text("# comment\nUUID=1-2 / ext4 defaults 0 1\n")
    (root / "dev/disk/by-uuid").mkdir(parents=True)
    os.mknod(root / "dev/sdb1", stat.S_IFBLK | 0o600, os.makedev(*NUMBER))
    os.mknod(root / "dev/sdb", stat.S_IFBLK | 0o600, os.makedev(8, 16))
    return Machine(root, disk)
