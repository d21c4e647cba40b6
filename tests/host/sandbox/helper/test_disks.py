"""Only what was plugged in, is nothing the machine uses, and is what it was then, is mounted."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.sandbox.helper.machines import NUMBER, SATA, Machine, machine

from nondum.sdk.errors import NondumError

ROOT_ONLY = pytest.mark.skipif(os.geteuid() != 0, reason="making device nodes needs root")
pytestmark = ROOT_ONLY


@pytest.fixture
def stick(tmp_path: Path) -> Iterator[Machine]:
    yield machine(tmp_path)


def refused(
    machine: Machine,
    words: str,
    device: str = "sdb1",
    diskseq: int | None = 7,
    code: str = "HELPER_REFUSED",
) -> None:
    with pytest.raises(NondumError) as error:
        machine.judge(device, diskseq)
    assert error.value.code == code
    assert words in str(error.value)


def test_partition_of_a_stick_may_be_mounted(stick: Machine) -> None:
    assert stick.judge() == stick.root / "dev/sdb1"


def test_fixed_disks_are_not_drives(tmp_path: Path) -> None:
    refused(machine(tmp_path, SATA), "does not hang on USB")


def test_folder_that_is_only_called_usb_is_no_bus(tmp_path: Path) -> None:
    refused(machine(tmp_path, SATA.replace("ata1", "usbx")), "does not hang on USB")


def test_another_insertion_is_another_drive(stick: Machine) -> None:
    refused(stick, "not the one that was plugged in then", diskseq=6)
    refused(stick, "not the one that was plugged in then", diskseq=None)


def test_disk_with_partitions_is_none_itself(stick: Machine) -> None:
    refused(stick, "partitions", "sdb")


def test_what_is_not_there_is_refused(stick: Machine) -> None:
    refused(stick, "no such block device", "sdc1")


def test_what_is_mounted_elsewhere_is_left_alone(stick: Machine) -> None:
    mountinfo = stick.root / "proc/self/mountinfo"
    mountinfo.write_text("30 22 8:17 / /home rw - ext4 /dev/sdb1 rw\n")
    refused(stick, "mounted on /home")
    mountinfo.write_text("30 22 8:17 / /media/ann/STICK rw - ext4 /dev/sdb1 rw\n")
    refused(stick, "mounted on /media/ann/STICK", code="DRIVE_MOUNTED")
    mountinfo.write_text("30 22 8:17 / /run/nondum/mounts/sdb1-7.read rw - ext4 /dev/sdb1 rw\n")
    assert stick.judge()


@pytest.mark.parametrize("spec", ["/dev/sdb1", "UUID=AB-CD", 'UUID="AB-CD"'])
def test_what_fstab_names_is_the_machine_s_own(stick: Machine, spec: str) -> None:
    (stick.root / "dev/disk/by-uuid/AB-CD").symlink_to("../../sdb1")
    (stick.root / "etc/fstab").write_text(f"{spec} /media/backup vfat noauto,user 0 0\n")
    refused(stick, "fstab")


def test_swap_and_parts_of_other_devices_are_left_alone(stick: Machine) -> None:
    swaps = stick.root / "proc/swaps"
    swaps.write_text("Filename Type Size Used Priority\n/dev/sdb1 partition 1 0 -2\n")
    refused(stick, "swaps")
    swaps.unlink()
    (stick.disk / "sdb1/holders/dm-0").mkdir()
    refused(stick, "made of it")


def test_node_of_another_device_is_seen_through(stick: Machine) -> None:
    (stick.root / "dev/sdb1").unlink()
    os.mknod(stick.root / "dev/sdb1", stat.S_IFBLK | 0o600, os.makedev(8, 1))
    refused(stick, "another device's")


def test_what_goes_while_it_is_looked_at_is_refused(stick: Machine) -> None:
    (stick.disk / "sdb1/dev").unlink()
    refused(stick, "just gone")


def test_node_of_another_kind_is_seen_through(stick: Machine) -> None:
    (stick.root / "dev/sdb1").unlink()
    os.mknod(stick.root / "dev/sdb1", stat.S_IFCHR | 0o600, os.makedev(*NUMBER))
    refused(stick, "another device's")


def test_loop_devices_are_drives_only_where_root_says_so(tmp_path: Path) -> None:
    loop = machine(tmp_path, "devices/virtual/block/loop0")
    refused(loop, "does not hang on USB")
    allowing = replace(loop.disks, allow_loop=True)
    assert allowing.node("sdb1", 7, Path("/nowhere")) == tmp_path / "dev/sdb1"
