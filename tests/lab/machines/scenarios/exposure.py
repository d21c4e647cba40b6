"""What systemd thinks of the daemon's own unit: its exposure is 5 of 10 at most."""

from __future__ import annotations

from tests.lab.machines.lab import Lab

MOST_EXPOSED = 5.0


def run(lab: Lab) -> str:
    """Ask `systemd-analyze security`."""
    machine = lab.host().machine
    said = machine.run("systemd-analyze security --no-pager nondum.service")
    exposure = float(said.strip().splitlines()[-1].split()[-3])
    assert exposure <= MOST_EXPOSED, f"exposure {exposure}"
    return f"exposure {exposure}"
