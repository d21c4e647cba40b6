"""pyusb on a granted device: here only refusals; a device is what scenario `raw-usb` is for."""

from __future__ import annotations

import builtins
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk import usb
from nondum.sdk.errors import BehaviourFailed
from nondum.sdk.usb import open_usb, raw_node
from nondum.sdk.workplace import Device, DeviceNode

RAW = {"SUBSYSTEM": "usb"}
LINE = DeviceNode("/dev/nondum/line", {"SUBSYSTEM": "tty"})


def refused(device: Device) -> BehaviourFailed:
    with pytest.raises(BehaviourFailed) as failed, open_usb(device):
        pass
    return failed.value


def test_raw_node_is_found_among_other_nodes() -> None:
    raw = DeviceNode("/dev/nondum/line.004", RAW)
    assert raw_node(Device(LINE.node, LINE.properties, (LINE, raw))) == raw.node
    assert raw_node(Device("/dev/nondum/it", RAW)) == "/dev/nondum/it"


def test_device_that_was_not_asked_for_raw_is_refused_with_the_way_out() -> None:
    with pytest.raises(BehaviourFailed, match="subsystem = 'usb'"):
        raw_node(Device(LINE.node, LINE.properties, (LINE,)))


def test_node_that_is_not_there_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("usb")
    failed = refused(Device(str(tmp_path / "gone"), RAW))
    assert failed.code in ("USB_UNUSABLE", "USB_LIBRARY")  # not every machine has libusb


def test_node_that_is_no_usb_device_is_refused() -> None:
    pytest.importorskip("usb")
    failed = refused(Device("/dev/null", RAW))
    assert failed.code in ("USB_UNUSABLE", "USB_LIBRARY")


def test_library_that_is_missing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("usb")
    monkeypatch.setattr(usb, "LIBRARY", "libnothing.so.7")
    assert refused(Device("/dev/null", RAW)).code == "USB_LIBRARY"


def test_payload_without_pyusb_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    load = builtins.__import__

    def without(name: str, *arguments: Any) -> Any:
        if name.startswith("usb"):
            raise ImportError(name)
        return load(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", without)
    failed = refused(Device("/dev/null", RAW))
    assert failed.code == "USB_LIBRARY"
    assert "pyusb" in str(failed)
