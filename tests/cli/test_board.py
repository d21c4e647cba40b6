"""`nondum doctor --board`: what a machine is, in a form to paste into an issue."""

from __future__ import annotations

import json
import socket
from pathlib import Path

import pytest
from tests.kit.command_line import nondum

from nondum.cli.board import disk_speed, hardware

PI = {
    "proc/device-tree/model": "Raspberry Pi 4 Model B Rev 1.5\0",
    "proc/cpuinfo": "processor\t: 0\nCPU implementer\t: 0x41\nCPU part\t: 0xd08\n\n"
    "processor\t: 1\nCPU implementer\t: 0x41\nCPU part\t: 0xd08\n\n"
    "Serial\t\t: 10000000deadbeef\n",
    "proc/meminfo": "MemTotal:        1895720 kB\nSwapTotal:        204796 kB\n",
    "proc/self/mountinfo": "28 1 179:2 / / rw,noatime shared:1 - ext4 /dev/root rw\n",
    "etc/os-release": 'PRETTY_NAME="Debian GNU/Linux 13 (trixie)"\nNAME="Debian"\n',
    "sys/devices/system/cpu/cpu0/cpufreq/cpuinfo_max_freq": "1800000\n",
    "sys/class/thermal/thermal_zone0/temp": "52100\n",
    "sys/class/thermal/thermal_zone1/temp": "47000\n",
    "sys/devices/mmc/block/mmcblk0/size": "62333952\n",
    "sys/devices/mmc/block/mmcblk0/device/type": "SD\n",
    "sys/devices/mmc/block/mmcblk0/device/name": "SC32G\n",
    "sys/devices/mmc/block/mmcblk0/device/serial": "0xdeadbeef\n",
    "sys/devices/mmc/block/mmcblk0/mmcblk0p2/partition": "2\n",
    "sys/devices/pci/usb1/speed": "480\n",
    "sys/devices/pci/usb2/speed": "5000\n",
    "sys/devices/gpu/uevent": "",
}
LINKS = {
    "sys/dev/block/179:2": "sys/devices/mmc/block/mmcblk0/mmcblk0p2",
    "sys/bus/usb/devices/usb1": "sys/devices/pci/usb1",
    "sys/bus/usb/devices/usb2": "sys/devices/pci/usb2",
    "sys/devices/pci/driver": "sys/bus/pci/drivers/xhci_hcd",
    "sys/class/drm/card0/device": "sys/devices/gpu",
    "sys/devices/gpu/driver": "sys/bus/platform/drivers/v3d",
}


@pytest.fixture
def pi(tmp_path: Path) -> Path:
    for name, text in PI.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    for name, target in LINKS.items():
        link = tmp_path / name
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(tmp_path / target)
    return tmp_path


def test_board_is_told_by_its_device_tree(pi: Path) -> None:
    assert hardware.model(pi) == "Raspberry Pi 4 Model B Rev 1.5"
    assert hardware.processors(pi) == ("2 × CPU implementer 0x41, CPU part 0xd08, up to 1800 MHz")
    assert hardware.memory(pi) == "1851 MB, swap 199 MB"
    assert hardware.system(pi) == "Debian GNU/Linux 13 (trixie)"
    assert hardware.usb_buses(pi) == "usb1: 480 Mbit/s, xhci_hcd; usb2: 5000 Mbit/s, xhci_hcd"
    assert hardware.graphics(pi) == "v3d"
    assert hardware.temperature(pi) == "52 °C"


def test_disk_is_told_without_its_serial_number(pi: Path) -> None:
    assert hardware.disk(pi, (179, 2)) == "mmcblk0, SD, SC32G, 32 GB"
    assert hardware.file_system(pi, (179, 2)) == "ext4 (rw,noatime)"
    assert hardware.disk(pi, (0, 31)) == "no block device"


def test_pc_is_told_by_its_firmware(tmp_path: Path) -> None:
    folder = tmp_path / "sys/class/dmi/id"
    folder.mkdir(parents=True)
    (folder / "sys_vendor").write_text("LENOVO\n")
    (folder / "product_name").write_text("20XW\n")
    assert hardware.model(tmp_path) == "LENOVO 20XW"


def test_machine_that_tells_nothing_is_not_known(tmp_path: Path) -> None:
    said = (hardware.model, hardware.system, hardware.temperature)
    assert {told(tmp_path) for told in said} == {hardware.UNKNOWN}
    assert hardware.usb_buses(tmp_path) == hardware.graphics(tmp_path) == "none"
    assert hardware.processors(tmp_path) == f"0 × {hardware.UNKNOWN}"


def test_measuring_a_disk_leaves_nothing_on_it(tmp_path: Path) -> None:
    speed = disk_speed.measure(tmp_path)
    assert min(speed.write_mb_s, speed.read_mb_s, speed.commit_ms) > 0
    assert not list(tmp_path.iterdir())


def test_report_is_a_table_that_has_no_names(tmp_path: Path) -> None:
    config = tmp_path / "host.toml"
    config.write_text(f'[host]\nname = "panther"\nstate = "{tmp_path / "state"}"\n')
    shown = nondum("doctor", "--board", "--config", str(config)).ok().out
    told = json.loads(nondum("doctor", "--board", "--config", str(config), "--json").ok().out)
    assert "| what | here |\n|---|---|\n" in shown
    whats = [row["what"] for row in told]
    assert all(f"| {what} | " in shown for what in whats)
    assert {"board", "kernel", "level sandboxed", "GPU", "its speed"} <= set(whats)
    names = {"panther", str(tmp_path), socket.gethostname()}
    assert not [name for name in names if name in shown]


def test_wrong_configuration_is_told(tmp_path: Path) -> None:
    config = tmp_path / "host.toml"
    config.write_text("[hots]\n")
    nondum("doctor", "--board", "--config", str(config)).refused(2, "CONFIG_KEY")
