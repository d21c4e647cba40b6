"""Nodes and interfaces come together to physical devices, in whatever order they are told."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.host.sources.devices.sightings import (
    camera_with_microphone,
    interface,
    node,
    platform,
    serial_adapter,
    usb,
)

from nondum.host.core.events.devices import DeviceAppeared, DeviceChanged, DeviceRemoved
from nondum.host.core.events.event import Event
from nondum.host.core.records.device import DeviceInterface, DeviceRecord
from nondum.host.sources.devices.hardware import Part, devices, lineage, physical, record
from nondum.host.sources.devices.source import Sightings
from nondum.host.sources.devices.udev import Tree

VIVID = platform("vivid.0")
ADAPTER = Part("/devices/i2c-0", "i2c", "", True, {})
MACHINE = [
    *camera_with_microphone("1-2"),
    *serial_adapter("1-4.2", "ttyUSB0", ID_SERIAL_SHORT="A1"),
    *serial_adapter("1-4.3", "ttyUSB1", ID_SERIAL_SHORT="A2"),
    node(VIVID, "video4linux", "video4"),
    node(VIVID, "video4linux", "video10"),
    node(ADAPTER, "i2c-dev", "i2c-0"),
]


def nodes_of(device: DeviceRecord) -> list[str]:
    return [str(one.node) for one in device.nodes]


def test_one_physical_device_is_one_with_all_its_nodes() -> None:
    camera = devices(MACHINE)["usb:1-2"]
    assert nodes_of(camera) == [
        *("/dev/video0", "/dev/video1", "/dev/snd/controlC1", "/dev/snd/pcmC1D0c"),
        "/dev/bus/usb/001/002",
    ]
    assert camera.interfaces == (
        DeviceInterface("00", "0e:01:00", "uvcvideo"),
        DeviceInterface("02", "01:01:00", "snd-usb-audio"),
    )
    assert (camera.bus, camera.port, camera.parent) == ("usb", "1-2", "usb:usb1")
    assert camera.driver == "uvcvideo, snd-usb-audio"
    assert camera.identity == "usb 046d:0825 CAFE"


def test_device_behind_a_hub_names_it() -> None:
    assert devices(MACHINE)["usb:1-4.2"].parent == "usb:1-4"


def test_what_is_on_no_usb_is_named_by_its_bus() -> None:
    found = devices(MACHINE)
    assert nodes_of(found["platform:vivid.0"]) == ["/dev/video4", "/dev/video10"]
    assert nodes_of(found["i2c:i2c-0"]) == ["/dev/i2c-0"]
    assert found["i2c:i2c-0"].driver == ""


def test_device_without_udev_is_known_by_what_the_kernel_says() -> None:
    plain = Part("/devices/usb1/1-1", "usb", "usb_device", True, {"PRODUCT": "16c0/5df/100"})
    raw = Part(plain.path, "usb", "usb_device", True, {**plain.properties, "DEVNAME": "/dev/x"})
    found = record([raw])
    assert found is not None
    assert (found.vendor, found.product) == ("16c0", "05df")


def test_parts_have_what_identifies_their_device() -> None:
    device = usb("1-3", ID_MODEL="Knob", ID_PATH="pci-0")
    knob = node(interface(device, 0, "3/0/0", "usbhid"), "hidraw", "hidraw0")
    found = record([knob, device])
    assert found is not None
    properties = found.nodes[0].properties
    assert properties["ID_MODEL"] == "Knob"
    assert properties["SUBSYSTEM"] == "hidraw"
    assert "ID_PATH" not in properties


def test_what_has_no_node_is_no_device() -> None:
    assert record([interface(usb(), 0, "9/0/0", "hub")]) is None


@given(st.permutations(MACHINE))
def test_order_in_which_parts_are_told_is_nothing(parts: list[Part]) -> None:
    assert devices(parts) == devices(MACHINE)


@given(st.sets(st.sampled_from(range(len(MACHINE)))))
def test_each_node_is_in_one_device(chosen: set[int]) -> None:
    parts = [MACHINE[i] for i in sorted(chosen)]
    found = [path for device in devices(parts).values() for path in nodes_of(device)]
    assert sorted(found) == sorted(part.node for part in parts if part.node)
    assert all(physical(part) in lineage(part) for part in parts)


@given(st.lists(st.tuples(st.sampled_from(range(len(MACHINE))), st.booleans()), max_size=40))
def test_whatever_comes_and_goes_the_told_devices_are_those_there(
    happened: list[tuple[int, bool]],
) -> None:
    """One after the other as all at once; what is told by differences comes to the same."""
    told: list[Event] = []
    tree = Tree(Sightings(told.append))
    there: dict[str, Part] = {}
    for i, comes in happened:
        part = MACHINE[i]
        tree.see([(part.path, part if comes else None)])
        if comes:
            there[part.path] = part
        else:
            there.pop(part.path, None)
    seen: dict[str, DeviceRecord] = {}
    for event in told:
        match event:
            case DeviceAppeared(device, found):
                assert device not in seen
                seen[device] = found
            case DeviceChanged(device, found):
                assert seen[device] != found
                seen[device] = found
            case DeviceRemoved(device):
                del seen[device]
    assert seen == devices(there.values())


def test_driver_that_comes_later_changes_the_device_and_is_no_replug() -> None:
    told: list[Event] = []
    tree = Tree(Sightings(told.append))
    for part in serial_adapter():
        tree.see([(part.path, part)])
    assert [type(event) for event in told] == [DeviceAppeared, DeviceChanged, DeviceChanged]
    assert {getattr(event, "device", "") for event in told} == {"usb:1-4"}


@pytest.mark.parametrize(
    "other",
    [
        pytest.param({"ID_SERIAL_SHORT": "B"}, id="another number"),
        pytest.param({"DEVNUM": "007"}, id="the same, plugged in again"),
    ],
)
def test_device_that_was_replugged_unseen_is_told_as_two(other: dict[str, str]) -> None:
    """Messages may be lost, and only what is there then be seen."""
    told: list[Event] = []
    tree = Tree(Sightings(told.append))
    tree.see_all([usb("1-4", ID_SERIAL_SHORT="A", DEVNUM="003")])
    tree.see_all([usb("1-4", **{"ID_SERIAL_SHORT": "A", "DEVNUM": "003", **other})])
    assert [type(event) for event in told] == [DeviceAppeared, DeviceRemoved, DeviceAppeared]


def test_replug_in_one_look_is_told_as_two() -> None:
    told: list[Event] = []
    tree = Tree(Sightings(told.append))
    device = usb("1-4")
    tree.see([(device.path, device)])
    tree.see([(device.path, None), (device.path, device)])
    assert [type(event) for event in told] == [DeviceAppeared, DeviceRemoved, DeviceAppeared]


def test_nodes_are_counted_as_people_do() -> None:
    line = interface(usb(), 0, "255/0/0")
    names = [f"ttyUSB{n}" for n in (10, 9, 0)]
    found = record([node(line, "tty", name) for name in names])
    assert found is not None
    assert [one.node for one in found.nodes] == [
        Path(f"/dev/{name}") for name in ("ttyUSB0", "ttyUSB9", "ttyUSB10")
    ]
