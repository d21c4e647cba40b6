"""A stick with a payload is plugged in, works, and is pulled; nothing of it is left."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.lab import Lab
from tests.lab.machine import Machine

PAYLOAD = "org.example.talker"


def run(lab: Lab) -> None:
    """Plug, look, pull, look."""
    host = lab.host()
    stick = host.bring(lab.stick("talker", talker()), PAYLOAD)
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    host.machine.until("no mount is left", lambda: None if _mounts(host.machine) else True)


def _mounts(machine: Machine) -> str:
    return machine.attempt("grep -E '/nondum/.*mounts|usb' /proc/mounts").out
