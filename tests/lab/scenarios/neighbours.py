"""Two hosts on one network meet and share what they have; one that is cut off is forgotten."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab

PAYLOAD = "org.example.talker"
ONE, OTHER = "panther", "mule"
SHARED = f"talker@{OTHER}"


def run(lab: Lab) -> str:
    """Meet, share, cut the cable, plug it in again, cut the power."""
    hosts = lab.fleet(ONE, OTHER)
    one, other = hosts[ONE], hosts[OTHER]
    one.until_peers(OTHER)
    other.until_peers(ONE)
    other.bring(lab.stick("talker", talker()), PAYLOAD)
    one.until_component(SHARED, "ready")

    other.machine.cut_cable()
    _until_forgotten(one)
    one.until_peers()
    other.until_peers()
    other.machine.plug_cable()
    one.until_peers(OTHER)
    one.until_component(SHARED, "ready")

    other.machine.cut_power()
    _until_forgotten(one)
    one.until_peers()
    return f"met by multicast; {SHARED} came and went with the cable, and with the power"


def _until_forgotten(host: Installed) -> None:
    """Wait until a host has nothing of the other any more."""

    def is_gone() -> bool | None:
        return None if any(row["host"] == OTHER for row in host.components()) else True

    host.machine.until(f"{host.name} forgets {OTHER}", is_gone)
