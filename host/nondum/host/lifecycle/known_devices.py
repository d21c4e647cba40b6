"""Which devices were ever here: remembered so that one that comes again, or elsewhere, is known."""

from __future__ import annotations

from collections.abc import Mapping

from nondum.host.core.records.device import DeviceRecord, KnownDevice

MOST = 200
"""Devices that are remembered, at most; beyond them the least recently seen are forgotten."""


def seen(
    known: Mapping[str, KnownDevice], device: DeviceRecord, wall_s: float
) -> dict[str, KnownDevice]:
    """What is remembered once a device has come or gone at a moment."""
    before = known.get(device.identity)
    first_s = min(before.first_s, wall_s) if before is not None else wall_s
    now = KnownDevice(device.identity, device.name, device.id, first_s, wall_s)
    others = {key: one for key, one in known.items() if key != device.identity}
    return dict([*others.items(), (device.identity, now)][-MOST:])
