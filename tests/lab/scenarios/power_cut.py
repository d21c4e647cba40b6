"""Power is cut while a payload is installed, twice; it comes back whole, with nothing left over."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.lab import Lab

PAYLOAD = "org.example.talker"
MOMENTS = ("staging", "venvs")
"""Folders of the state folder in whose first use power is cut."""
WAIT = "until ls -d /var/lib/nondum/{folder}/* 2>/dev/null; do sleep 0.02; done"


def run(lab: Lab) -> str:
    """Cut, boot, cut, boot, look."""
    host = lab.booted()
    machine, image = host.machine, lab.stick("talker", talker())
    host.start()
    for folder in MOMENTS:
        machine.plug(image)
        machine.run(WAIT.format(folder=folder), timeout_s=240)
        machine.cut_power()
        machine.boot()
    host.wait_until_started()
    host.bring(image, PAYLOAD)
    left = machine.run("ls /var/lib/nondum/staging").split()
    assert not left, f"left in staging: {left}"
    recovered = machine.run("nondum journal --limit 1000 --json", timeout_s=120)
    assert "RECOVER" in recovered.upper(), "nothing was recovered"
    return f"cut in {' and '.join(MOMENTS)}"
