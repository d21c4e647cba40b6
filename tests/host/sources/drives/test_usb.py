"""A stick that is something else too is found out by the interfaces beside its own."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.host.sources.drives.usb_devices import stick

from nondum.host.sources.drives.usb import extra_interfaces, port_of


@pytest.mark.parametrize("classes", [("08",), ("08", "08")], ids=["one", "two-stores"])
def test_plain_sticks_are_drives(tmp_path: Path, classes: tuple[str, ...]) -> None:
    assert extra_interfaces(stick(tmp_path, *classes), "sdb") == ()


@pytest.mark.parametrize(
    ("classes", "words"),
    [
        (("08", "03"), "03 (keyboard, mouse or other input)"),
        (("03", "08"), "03 (keyboard"),
        (("08", "02", "0a"), "02 (modem or network), 0a (modem or network data)"),
        (("08", "e0"), "e0 (wireless)"),
        (("08", "ff"), "ff (the maker's own)"),
        (("08", "42"), "42 (unknown)"),
    ],
    ids=["keyboard", "keyboard-first", "network", "wireless", "own", "unheard-of"],
)
def test_stick_that_is_more_is_refused(
    tmp_path: Path, classes: tuple[str, ...], words: str
) -> None:
    (problem,) = extra_interfaces(stick(tmp_path, *classes), "sdb-7")
    assert (problem.code, problem.where) == ("USB_EXTRA_INTERFACE", "sdb-7")
    assert words in problem.have
    assert problem.fix


def test_partition_is_judged_by_its_stick(tmp_path: Path) -> None:
    partition = stick(tmp_path, "08", "03") / "sdb1"
    partition.mkdir()
    assert extra_interfaces(partition, "sdb1")


def test_neighbour_on_the_same_hub_is_another_device(tmp_path: Path) -> None:
    """A hub is a USB device too; what else hangs on it is none of the stick's interfaces."""
    root = tmp_path / "devices/pci0/usb1/1-1"
    for device, name in (("1-1.1", "08"), ("1-1.2", "03")):
        (root / device / f"{device}:1.0").mkdir(parents=True)
        (root / device / f"{device}:1.0/bInterfaceClass").write_text(f"{name}\n")
        (root / device / "bDeviceClass").write_text("00\n")
    (root / "1-1:1.0").mkdir()
    (root / "1-1:1.0/bInterfaceClass").write_text("09\n")
    (root / "bDeviceClass").write_text("09\n")
    block = root / "1-1.1/1-1.1:1.0/host0/block/sda"
    block.mkdir(parents=True)
    assert extra_interfaces(block, "sda") == ()


def test_what_is_not_on_usb_has_no_interfaces(tmp_path: Path) -> None:
    block = tmp_path / "devices/virtual/block/loop0"
    block.mkdir(parents=True)
    assert extra_interfaces(block, "loop0") == ()


def test_port_is_the_same_for_whatever_is_plugged_in(tmp_path: Path) -> None:
    disk = stick(tmp_path, "08")
    assert port_of(disk) == port_of(disk / "sdb1") == "1-1"
