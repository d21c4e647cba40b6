"""What block devices are needed for, looked up on a machine of the test's own, and on this one."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path

import pytest
from tests.kit.golden import Golden

from nondum.host.sandbox.helper.block_devices import Machine
from nondum.host.sources.drives.disk_report import Owner, disks

USB = "devices/pci0000:00/0000:00:14.0/usb1/1-2/1-2:1.0/host6/target6:0:0/6:0:0:0/block/sdb"
SATA = "devices/pci0000:00/0000:00:17.0/ata1/host0/target0:0:0/0:0:0:0/block/sda"
OURS = Path("/run/nondum/mounts")
pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="making device nodes needs root")


@dataclass
class Computer:
    """A machine's folders: a fixed disk with the system, and a USB disk of two partitions."""

    root: Path

    @property
    def machine(self) -> Machine:
        root = self.root
        return Machine(
            root / "sys",
            root / "proc",
            root / "dev",
            root / "etc",
            (root / "vendor", root / "site"),
        )

    def write(self, path: str, text: str) -> None:
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def add(self, place: str, number: tuple[int, int], *, is_partition: bool = False) -> None:
        """Have a block device shown in sysfs, with a node."""
        name = place.rpartition("/")[2]
        self.write(f"sys/{place}/dev", "{}:{}\n".format(*number))
        self.write(f"sys/{place}/size", "2048\n")
        if is_partition:
            self.write(f"sys/{place}/partition", "1\n")
        link = self.root / "sys/class/block" / name
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(self.root / "sys" / place)
        (self.root / "dev").mkdir(exist_ok=True)
        os.mknod(self.root / "dev" / name, stat.S_IFBLK | 0o600, os.makedev(*number))

    def owners(self) -> dict[str, str]:
        return {disk.name: disk.owner.value for disk in disks(self.machine, OURS)}


@pytest.fixture
def computer(tmp_path: Path) -> Computer:
    computer = Computer(tmp_path)
    computer.add(SATA, (8, 0))
    computer.add(USB, (8, 16))
    computer.add(f"{USB}/sdb1", (8, 17), is_partition=True)
    computer.add(f"{USB}/sdb2", (8, 18), is_partition=True)
    computer.write("proc/self/mountinfo", "22 1 8:0 / / rw - ext4 /dev/sda rw\n")
    return computer


def test_unused_disk_has_drives_for_partitions(computer: Computer) -> None:
    assert computer.machine.uses(OURS).keys() == {"sda"}
    owners = {"sda": "host", "sdb": "", "sdb1": "drive", "sdb2": "drive"}
    assert computer.owners() == owners


def test_usb_disk_that_the_machine_boots_from_is_its_own(computer: Computer) -> None:
    """Its root may be hidden beneath another file system: the kernel's command line tells."""
    computer.write("proc/cmdline", "root=/dev/sdb2 ro\n")
    assert computer.owners() == dict.fromkeys(("sda", "sdb", "sdb1", "sdb2"), "host")


def test_file_system_of_several_devices_is_known_by_what_was_mounted(
    computer: Computer, golden: Golden
) -> None:
    """Its number in mountinfo is no block device's."""
    with (computer.root / "proc/self/mountinfo").open("a") as mountinfo:
        mountinfo.write("23 22 0:41 /@ /var rw - btrfs /dev/sdb1 rw\n")
    golden.check("a disk is mounted", computer.machine.uses(OURS)["sdb1"].why)


def test_mounted_by_a_person_is_somebody_s_until_fstab_says_so_too(computer: Computer) -> None:
    computer.write("proc/self/mountinfo", "23 22 8:17 / /media/ann/X rw - vfat /dev/sdb1 rw\n")
    assert computer.owners()["sdb1"] == Owner.SOMEBODY.value
    assert computer.owners()["sdb2"] == Owner.DRIVE.value
    computer.write("etc/fstab", "/dev/sdb1 /media/ann/X vfat noauto,user\n")
    assert computer.owners()["sdb1"] == computer.owners()["sdb2"] == Owner.HOST.value


@pytest.mark.parametrize(
    ("file", "text", "use"),
    [
        ("srv-data.mount", "[Mount]\nWhat=/dev/sdb1\nWhere=/srv/data\n", "a unit mounts a disk"),
        ("srv-data.mount.d/disk.conf", "[Mount]\nWhat = /dev/sdb1\n", "a unit mounts a disk"),
        ("dev-sdb1.swap", "[Swap]\nWhat=/dev/sdb1\n", "a unit swaps to a disk"),
    ],
)
@pytest.mark.parametrize("folder", ["vendor", "site"])
def test_named_by_a_unit_is_the_machine_s_own_mounted_or_not(
    computer: Computer, folder: str, file: str, text: str, use: str, golden: Golden
) -> None:
    computer.write(f"{folder}/{file}", text)
    unit = file.partition(".d/")[0]
    golden.check(use, computer.machine.uses(OURS)["sdb1"].why, unit=unit)
    assert computer.owners() == dict.fromkeys(("sda", "sdb", "sdb1", "sdb2"), "host")


def test_units_that_mount_nothing_of_a_disk_or_are_masked_say_nothing(computer: Computer) -> None:
    computer.write("vendor/tmp.mount", "[Mount]\nWhat=tmpfs\nWhere=/tmp\n")
    computer.write("vendor/disk.service", "[Mount]\nWhat=/dev/sdb1\n")
    computer.write("vendor/old.mount", "[Mount]\n#What=/dev/sdb1\nWhere=/dev/sdb1\n")
    (computer.root / "vendor/gone.mount").symlink_to("/dev/null")
    assert computer.owners()["sdb1"] == Owner.DRIVE.value


def test_mounted_by_this_host_to_be_read_is_still_a_drive(computer: Computer) -> None:
    computer.write("proc/self/mountinfo", f"23 22 8:17 / {OURS}/sdb1-7 ro - vfat /dev/sdb1 ro\n")
    assert computer.owners()["sdb1"] == Owner.DRIVE.value


def test_decrypted_and_swapped_to_are_the_machine_s_own(computer: Computer) -> None:
    computer.write("etc/crypttab", "data /dev/sdb1 none\n")
    assert "decrypts" in computer.machine.uses(OURS)["sdb1"].why
    computer.write("proc/swaps", "Filename Type\n/dev/sdb2 partition 1 0 -2\n")
    assert "swaps" in computer.machine.uses(OURS)["sdb2"].why


def test_what_is_not_there_and_what_goes_meanwhile_says_nothing(
    computer: Computer, tmp_path: Path
) -> None:
    nothing = tmp_path / "nothing"
    assert Machine(nothing, nothing, nothing, nothing, (nothing,)).uses(OURS) == {}
    (computer.root / "sys" / USB / "sdb1/dev").unlink()
    assert [block.name for block in computer.machine.blocks()] == ["sda", "sdb", "sdb2"]


def test_this_machine_s_disks_can_be_looked_at() -> None:
    found = list(disks(Machine(), OURS))
    assert all(disk.size > 0 for disk in found)
    assert not [disk for disk in found if disk.owner is Owner.DRIVE and not disk.is_usb]
