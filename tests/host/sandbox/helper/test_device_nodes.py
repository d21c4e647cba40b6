"""Components get nodes of what was plugged in for them, and of nothing else."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any

import pytest
from tests.kit.golden import Golden

from nondum.host.sandbox.helper.device_nodes import Nodes
from nondum.sdk.errors import NondumError

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="making device nodes needs root")
SERVED = 65534
INTERFACE = "devices/pci0000:00/usb1/1-2/1-2:1.0"


def plug(sys: Path, place: str, number: str, subsystem: str, *, interface: str = "ff 00") -> None:
    """Have a device in sysfs."""
    device = sys / place
    device.mkdir(parents=True)
    kind, protocol = interface.split()
    if "1-2:1.0" in place:
        (sys / INTERFACE / "bInterfaceClass").write_text(f"{kind}\n")
        (sys / INTERFACE / "bInterfaceProtocol").write_text(f"{protocol}\n")
    (sys / "class" / subsystem).mkdir(parents=True)
    (device / "subsystem").symlink_to(sys / "class" / subsystem)
    (sys / "dev/char").mkdir(parents=True)
    (sys / "dev/char" / number).symlink_to(device)


def nodes(tmp_path: Path, *subsystems: str) -> Nodes:
    return Nodes(tmp_path / "run", SERVED, frozenset(subsystems), tmp_path / "sys")


def refused(nodes: Nodes, number: tuple[int, int]) -> str:
    with pytest.raises(NondumError) as error:
        nodes.put("eye", "line", *number)
    assert error.value.code == "HELPER_REFUSED"
    assert not (nodes.base / "eye").exists()
    return error.value.problems[0].message


def test_node_is_made_for_its_user_alone_and_removed(tmp_path: Path) -> None:
    plug(tmp_path / "sys", f"{INTERFACE}/ttyUSB0/tty/ttyUSB0", "188:0", "tty")
    made = nodes(tmp_path)
    node = made.put("eye", "line", 188, 0)
    found = node.lstat()
    assert stat.S_ISCHR(found.st_mode)
    assert (os.major(found.st_rdev), os.minor(found.st_rdev)) == (188, 0)
    assert (stat.S_IMODE(found.st_mode), found.st_uid) == (0o600, SERVED)
    assert node == made.put("eye", "line", 188, 0)
    made.take("eye", "line")
    made.take("eye", "line")
    assert not node.exists()
    made.put("eye", "line", 188, 0)
    made.clear("eye")
    assert not (made.base / "eye").exists()
    made.clear("")


@pytest.mark.parametrize(
    ("place", "subsystem", "interface"),
    [
        pytest.param("devices/pci0000:00/nvme/nvme0", "nvme", "ff 00", id="disk controller"),
        pytest.param(f"{INTERFACE}/host6/sg1", "scsi_generic", "08 50", id="raw SCSI of a stick"),
        pytest.param(f"{INTERFACE}/host6/sg1", "scsi_generic", "ff 00", id="raw SCSI of a bridge"),
        pytest.param(f"{INTERFACE}/other", "usbmisc", "08 50", id="drive's interface"),
        pytest.param(f"{INTERFACE}/0003:1/input/event3", "input", "03 01", id="keyboard"),
        pytest.param(f"{INTERFACE}/0003:1/hidraw/hidraw0", "hidraw", "03 01", id="raw keyboard"),
        pytest.param("devices/virtual/mem/mem", "mem", "ff 00", id="memory"),
        pytest.param("devices/virtual/misc/kvm", "misc", "ff 00", id="kernel's own"),
        pytest.param("devices/platform/serial8250/tty/ttyS0", "tty", "ff 00", id="console"),
    ],
)
def test_what_is_not_a_guest_s_is_refused(
    tmp_path: Path, place: str, subsystem: str, interface: str
) -> None:
    plug(tmp_path / "sys", place, "21:1", subsystem, interface=interface)
    refused(nodes(tmp_path), (21, 1))


def test_raw_usb_node_of_a_keyboard_or_hub_is_refused(tmp_path: Path) -> None:
    sys = tmp_path / "sys"
    plug(sys, "devices/pci0000:00/usb1/1-2", "189:1", "usb")
    interface = sys / INTERFACE
    interface.mkdir()
    (interface / "bInterfaceClass").write_text("03")
    (interface / "bInterfaceProtocol").write_text("01")
    assert "keyboards" in refused(nodes(tmp_path), (189, 1))
    (interface / "bInterfaceProtocol").write_text("02")
    (sys / "devices/pci0000:00/usb1/1-2/bDeviceClass").write_text("09")
    assert "hubs" in refused(nodes(tmp_path), (189, 1))


LETTERS_AND_ENTER = "10000 7 ff9f207ac14057ff febeffdfffefffff fffffffffffffffe"
"""Key bits of a keyboard, as sysfs tells them."""
BUTTONS = {
    "mouse": "1f0000 0 0 0 0",
    "game pad": "7fdb000000000000 0 0 0 0",
    "volume keys": "3e000000000000 0 0 0",
    "presenter": "2000000000000 0 0 0 1000000000000",
}


def input_device(sys: Path, place: str, keys: str) -> None:
    """An input device in sysfs, and the keys that its driver tells."""
    folder = sys / place / "capabilities"
    folder.mkdir(parents=True)
    (folder / "key").write_text(f"{keys}\n")


@pytest.mark.parametrize(
    ("place", "subsystem"),
    [
        (f"{INTERFACE}/0003:1/input/input3/event3", "input"),
        (f"{INTERFACE}/0003:1/hidraw/hidraw0", "hidraw"),
        (f"{INTERFACE}/usbmisc/hiddev0", "usbmisc"),
        ("devices/pci0000:00/usb1/1-2", "usb"),
    ],
    ids=["input", "hidraw", "hiddev", "usb"],
)
def test_what_has_letters_and_enter_is_a_keyboard_whatever_its_protocol(
    tmp_path: Path, place: str, subsystem: str
) -> None:
    sys, keys = tmp_path / "sys", f"{INTERFACE}/0003:1/input/input3"
    plug(sys, place, "240:0", subsystem, interface="03 00")
    input_device(sys, keys, LETTERS_AND_ENTER)
    assert "keyboards" in refused(nodes(tmp_path), (240, 0))


@pytest.mark.parametrize("keys", BUTTONS.values(), ids=BUTTONS)
def test_what_has_other_keys_is_none(tmp_path: Path, keys: str) -> None:
    sys = tmp_path / "sys"
    plug(sys, f"{INTERFACE}/0003:1/hidraw/hidraw0", "240:0", "hidraw", interface="03 00")
    input_device(sys, f"{INTERFACE}/0003:1/input/input3", keys)
    assert nodes(tmp_path).put("eye", "line", 240, 0).exists()


def test_a_keyboard_beside_keeps_back_only_what_is_its_own(tmp_path: Path) -> None:
    sys, other = tmp_path / "sys", "devices/pci0000:00/usb1/1-2/1-2:1.1"
    plug(sys, f"{INTERFACE}/0003:1/input/input4/event4", "13:68", "input", interface="03 00")
    input_device(sys, f"{INTERFACE}/0003:1/input/input3", LETTERS_AND_ENTER)
    input_device(sys, f"{INTERFACE}/0003:1/input/input4", BUTTONS["mouse"])
    (sys / other / "ttyACM0").mkdir(parents=True)
    (sys / other / "ttyACM0/subsystem").symlink_to(sys / "class/input")
    (sys / "dev/char/166:0").symlink_to(sys / other / "ttyACM0")
    made = nodes(tmp_path)
    assert made.put("eye", "mouse", 13, 68).exists()
    assert made.put("eye", "line", 166, 0).exists()


def test_nodes_go_with_their_device(tmp_path: Path) -> None:
    sys = tmp_path / "sys"
    plug(sys, f"{INTERFACE}/ttyUSB0/tty/ttyUSB0", "188:0", "tty")
    made = nodes(tmp_path)
    one, other = made.put("eye", "line", 188, 0), made.put("arm", "wire", 188, 0)
    made.drop(188, 1)
    assert one.exists()
    assert made.are_there
    made.drop(188, 0)
    assert not one.exists()
    assert not other.exists()
    assert not made.are_there


def test_a_device_that_goes_meanwhile_leaves_no_node(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sys, chown = tmp_path / "sys", os.chown
    plug(sys, f"{INTERFACE}/ttyUSB0/tty/ttyUSB0", "188:0", "tty")

    def pull(*arguments: Any) -> None:
        chown(*arguments)
        (sys / "dev/char/188:0").unlink()

    monkeypatch.setattr(os, "chown", pull)  # between the look at the device and its node
    made = nodes(tmp_path)
    with pytest.raises(NondumError) as error:
        made.put("eye", "line", 188, 0)
    assert error.value.code == "HELPER_REFUSED"
    assert not made.are_there


def test_nodes_of_numbers_that_are_something_else_now_go(tmp_path: Path) -> None:
    sys = tmp_path / "sys"
    plug(sys, f"{INTERFACE}/0003:1/hidraw/hidraw0", "240:0", "hidraw", interface="03 00")
    made = nodes(tmp_path)
    node = made.put("eye", "line", 240, 0)
    made.drop_unfit()
    assert node.exists()
    input_device(sys, f"{INTERFACE}/0003:1/input/input9", LETTERS_AND_ENTER)
    made.drop_unfit()
    assert not node.exists()
    (sys / "dev/char/240:0").unlink()
    made.drop_unfit()


def test_folder_that_another_process_removes_meanwhile_is_passed_over(tmp_path: Path) -> None:
    plug(tmp_path / "sys", f"{INTERFACE}/ttyUSB0/tty/ttyUSB0", "188:0", "tty")
    made = nodes(tmp_path)
    node = made.put("eye", "line", 188, 0)
    (made.base / "arm").symlink_to("gone")  # listed, and not there when it is looked into
    made.drop(188, 0)
    assert not node.exists()
    assert not made.are_there


def test_node_goes_once_nothing_is_known_of_its_device(tmp_path: Path) -> None:
    sys = tmp_path / "sys"
    plug(sys, f"{INTERFACE}/0003:1/hidraw/hidraw0", "240:0", "hidraw", interface="03 00")
    made = nodes(tmp_path)
    node = made.put("eye", "line", 240, 0)
    at = os.open(sys / INTERFACE / "0003:1", os.O_RDONLY)
    for _ in range(20):  # a folder that cannot be listed by its name
        os.mkdir("d" * 250, dir_fd=at)
        below = os.open("d" * 250, os.O_RDONLY, dir_fd=at)
        os.close(at)
        at = below
    os.close(at)
    with pytest.raises(OSError):
        made.put("eye", "line", 240, 0)
    made.drop_unfit()
    assert not node.exists()


def test_integrator_may_grant_what_does_not_hang_on_usb(tmp_path: Path) -> None:
    plug(tmp_path / "sys", "devices/platform/csi/video4linux/video0", "81:0", "video4linux")
    assert "USB" in refused(nodes(tmp_path), (81, 0))
    assert nodes(tmp_path, "video4linux").put("eye", "line", 81, 0).exists()


def test_number_without_a_device_is_refused(tmp_path: Path, golden: Golden) -> None:
    (tmp_path / "sys/dev/char").mkdir(parents=True)
    golden.check("there is no such device", refused(nodes(tmp_path), (188, 0)))
