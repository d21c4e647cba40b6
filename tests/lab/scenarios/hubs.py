"""A stick behind two hubs works, goes with its hub, and is known when it comes back elsewhere."""

from __future__ import annotations

import re
from typing import NamedTuple

from tests.daemon.plugins import talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab

PAYLOAD = "org.example.talker"
USB_DEVICE = re.compile(r"\d+-[\d.]+")


class Place(NamedTuple):
    """What is to be seen of a stick that works."""

    address: str
    """Where it is, as the kernel says it: `1-4.2.1` is port 1 of a hub at port 2 of one at 4."""
    serial: str
    key: str
    """Of its payload."""


def run(lab: Lab) -> str:
    """Hub in hub, stick in that; pull the first hub; plug the stick in at the machine."""
    host = lab.host()
    image = lab.stick("talker", talker())
    first = host.machine.plug_hub("4")
    host.machine.plug_hub("4.2")
    host.bring(image, PAYLOAD, port="4.2.1")
    far = _seen(host)
    host.machine.unplug(first)
    host.until_payload(PAYLOAD, "gone")
    stick = host.bring(image, PAYLOAD, port="2")
    near = _seen(host)
    assert far.address.endswith("-4.2.1"), far
    assert near.address.endswith("-2"), near
    assert far[1:] == near[1:], f"known as {far}, then as {near}"
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    return f"{far.address}, then {near.address}"


def _seen(host: Installed) -> Place:
    view = host.until("the drive", lambda view: view if view["drives"] else None)
    node = view["drives"][0]["drive"].partition("-")[0]
    path = host.machine.run(f"udevadm info -q path -n /dev/{node}")
    said = host.machine.run(f"udevadm info -q property --property ID_SERIAL_SHORT -n /dev/{node}")
    addresses = [part for part in path.split("/") if USB_DEVICE.fullmatch(part)]
    return Place(addresses[-1], said.strip(), view["payloads"][0]["key"])
