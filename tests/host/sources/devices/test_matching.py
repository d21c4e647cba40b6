"""Which nodes a need may have, and what no component is given."""

from __future__ import annotations

import pytest
from tests.host.sources.devices.sightings import (
    camera_with_microphone,
    interface,
    node,
    platform,
    serial_adapter,
    usb,
)
from tests.kit.golden import Golden

from nondum.host.core.records.device import DeviceRecord
from nondum.host.sources.devices.hardware import Part, record
from nondum.host.sources.devices.matching import left_alone, serving, tried


def made(parts: list[Part]) -> DeviceRecord:
    device = record(parts)
    assert device is not None
    return device


ADAPTER = made(serial_adapter(ID_SERIAL_SHORT="A9XYZ", ID_MODEL="FT232R"))
CAMERA = made(camera_with_microphone())


def hid(kind: str, *more: Part, **properties: str) -> DeviceRecord:
    """A HID: its raw node, hidraw and an input node."""
    device = usb("1-6", ID_VENDOR_ID="0627", ID_MODEL_ID="0001")
    line = interface(device, 0, kind, "usbhid")
    event = node(line, "input", "input/event3", **properties)
    return made([device, line, node(line, "hidraw", "hidraw0"), event, *more])


KEYBOARD = hid("3/1/1", ID_INPUT_KEYBOARD="1")
MOUSE = hid("3/1/2", ID_INPUT_MOUSE="1")
TABLET = hid("3/0/0", ID_INPUT_MOUSE="1")
KNOB = hid("3/0/0")


def names(device: DeviceRecord, match: dict[str, str]) -> list[str]:
    return [one.node.name for one in serving(device, match)]


@pytest.mark.parametrize(
    ("match", "found"),
    [
        ({"usb": "0403:6001"}, ["ttyUSB0"]),
        ({"usb": "0403:*"}, ["ttyUSB0"]),
        ({"usb": "1a86:7523 | 0403:6001"}, ["ttyUSB0"]),
        ({"usb": "0403:6002"}, []),
        ({"serial": "A9*"}, ["ttyUSB0"]),
        ({"bus": "usb", "subsystem": "tty"}, ["ttyUSB0"]),
        ({"driver": "ftdi_sio"}, ["ttyUSB0"]),
        ({"port": "1-4"}, ["ttyUSB0"]),
        ({"interface": "vendor"}, ["ttyUSB0"]),
        ({"interface": "FF:ff"}, ["ttyUSB0"]),
        ({"interface": "03"}, []),
        ({"ID_MODEL": "FT232*", "usb": "0403:6001"}, ["ttyUSB0"]),
        ({"ID_MODEL": "FT232*", "usb": "0403:6002"}, []),
    ],
)
def test_all_rules_must_match(match: dict[str, str], found: list[str]) -> None:
    assert names(ADAPTER, match) == found


def test_raw_node_is_for_who_asks_for_it() -> None:
    assert names(ADAPTER, {"usb": "0403:6001", "subsystem": "usb"}) == ["004"]


def test_nodes_that_match_are_one_group() -> None:
    assert names(CAMERA, {"subsystem": "video4linux"}) == ["video0", "video1"]
    assert names(CAMERA, {"interface": "audio"}) == ["controlC1", "pcmC1D0c"]
    assert names(CAMERA, {"usb": "046d:0825"}) == ["video0", "video1", "controlC1", "pcmC1D0c"]


def test_keyboards_are_nobodys(golden: Golden) -> None:
    golden.check("a keyboard", left_alone(KEYBOARD))
    for match in ({"usb": "0627:0001"}, {"subsystem": "hidraw"}, {"subsystem": "usb"}):
        assert names(KEYBOARD, match) == []


@pytest.mark.parametrize("pointer", [MOUSE, TABLET], ids=["mouse", "tablet"])
def test_what_people_point_with_goes_to_who_names_it(pointer: DeviceRecord) -> None:
    assert names(pointer, {"subsystem": "hidraw"}) == []
    assert names(pointer, {"subsystem": "hidraw", "usb": "*:*"}) == []
    assert names(pointer, {"subsystem": "hidraw", "usb": "0627:0001"}) == ["hidraw0"]
    assert not left_alone(pointer)


def test_picture_is_given_although_people_touch_the_same_device() -> None:
    board = platform("vivid.0")
    touch = node(board, "input", "input/event4", ID_INPUT_TOUCHSCREEN="1")
    screen = made([board, node(board, "video4linux", "video0"), touch])
    assert names(screen, {"driver": "vivid"}) == ["video0"]
    assert names(screen, {"subsystem": "input"}) == []


def test_other_hids_go_to_who_asks() -> None:
    assert names(KNOB, {"subsystem": "hidraw"}) == ["hidraw0"]


def test_keyboard_without_a_protocol_is_known_by_its_keys() -> None:
    device = usb("1-7", ID_VENDOR_ID="0627", ID_MODEL_ID="0001")
    games = interface(device, 1, "3/0/0", "usbhid")
    keys = node(games, "input", "input/event5", ID_INPUT="1", ID_INPUT_KEYBOARD="1")
    wheel = node(games, "input", "input/event6", ID_INPUT="1", ID_INPUT_MOUSE="1")
    both = hid("3/0/0", games, node(games, "hidraw", "hidraw1"), keys, wheel)
    named = {"usb": "0627:0001"}
    assert names(both, {"subsystem": "hidraw"} | named) == ["hidraw0"]
    assert names(both, {"subsystem": "usb"} | named) == []
    assert names(both, {"subsystem": "input"} | named) == ["event3", "event6"]


def test_keyboard_hidden_in_an_instrument_is_not_given_with_it() -> None:
    device = usb("1-6", ID_VENDOR_ID="0627", ID_MODEL_ID="0001")
    typing = interface(device, 1, "3/1/1", "usbhid")
    both = hid("3/0/0", typing, node(typing, "hidraw", "hidraw1"))
    assert names(both, {"subsystem": "hidraw"}) == ["hidraw0"]
    assert names(both, {"subsystem": "usb"}) == []


@pytest.mark.parametrize(("kind", "what"), [("9/0/0", "a hub"), ("8/6/80", "a drive")])
def test_hubs_and_drives_are_nobodys(kind: str, what: str, golden: Golden) -> None:
    device = usb("1-1")
    thing = made([device, interface(device, 0, kind)])
    golden.check(what, left_alone(thing))
    assert names(thing, {"subsystem": "usb"}) == []


def test_disk_on_another_bus_is_nobodys(golden: Golden) -> None:
    disk = Part("/devices/pci0/0000:00:05.0", "pci", "", True, {})
    golden.check("a drive", left_alone(made([node(disk, "scsi_generic", "sg0")])))


def test_it_is_told_which_rule_failed_and_what_was_found() -> None:
    (line, raw) = tried(ADAPTER, {"usb": "0403:6001", "ID_MODEL": "CH340"})
    assert [(v.key, v.found, v.matched) for v in line.verdicts] == [
        ("usb", ("0403:6001",), True),
        ("ID_MODEL", ("FT232R",), False),
    ]
    assert "subsystem" in raw.kept_back
