"""What systemd thinks of nondum's units: no worse than it was."""

from __future__ import annotations

from tests.lab.lab import Lab
from tests.lab.machine import Machine

MOST_EXPOSED = {"nondum.service": 4.0, "nondum-helper.service": 4.4}
"""By `systemd-analyze security`: 0 is safe, 10 is not. Lower them as units get better."""


def run(lab: Lab) -> str:
    """Start both units; ask `systemd-analyze security`."""
    host = lab.host()
    host.machine.run("systemctl start nondum-helper.service")  # which ends when nothing asks it
    found = {unit: _exposure(host.machine, unit) for unit in MOST_EXPOSED}
    worse = {unit: each for unit, each in found.items() if each > MOST_EXPOSED[unit]}
    assert not worse, f"more exposed than they were: {worse}"
    return ", ".join(f"{unit} {each}" for unit, each in found.items())


def _exposure(machine: Machine, unit: str) -> float:
    said = machine.run(f"systemd-analyze security --no-pager {unit}")
    return float(said.strip().splitlines()[-1].split()[-3])
