"""A stick behind two hubs works, goes with its hub, and is known when it comes back elsewhere."""

from __future__ import annotations

from tests.lab.machines.lab import Lab
from tests.lab.plugins import talker

PAYLOAD = "org.example.talker"


def run(lab: Lab) -> str:
    """Hub in hub, stick in that; pull the first hub; plug the stick in at the machine."""
    host = lab.host()
    image = lab.stick("talker", talker())
    first = host.machine.plug_hub("4")
    host.machine.plug_hub("4.2")
    host.bring(image, PAYLOAD, port="4.2.1")
    far = _address(host.machine.run("udevadm info -q path -n /dev/sda"))
    host.machine.unplug(first)
    host.until_payload(PAYLOAD, "gone")
    stick = host.bring(image, PAYLOAD, port="2")
    near = _address(host.machine.run("udevadm info -q path -n /dev/sda"))
    known = host.machine.run("nondum journal --json --limit 1000")
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    return f"{far} then {near} {len(known)}"


def _address(path: str) -> str:
    """Where on its bus a device is, of its path in sysfs: `1-4.2.1`."""
    return next(p for p in path.split("/") if "-" in p and p[0].isdigit())
