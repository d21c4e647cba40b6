"""What systemd thinks of nondum's units, and of a worker that is one: no worse than it was."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.lab import Lab
from tests.lab.machine import Machine

AT_LEVEL_2 = 'confinement = "2"\n'
MOST_EXPOSED = {
    "nondum.service": 3.8,
    "nondum-helper.service": 4.3,
    "nondum-warden@": 1.7,
    "nondum-worker-": 0.5,
}
"""Of units whose names begin so, by `systemd-analyze security`: 0 is safe, 10 is not. Lower them as
units get better."""


def run(lab: Lab) -> str:
    """Have a worker at level 2, so that all units are there; ask `systemd-analyze security`."""
    host = lab.host(more=AT_LEVEL_2)
    stick = host.bring(lab.stick("talker", talker()), "org.example.talker")
    host.machine.run("systemctl start nondum-helper.service")  # which ends when nobody asks it
    found = {begin: _exposure(host.machine, begin) for begin in MOST_EXPOSED}
    host.machine.pull(stick)
    worse = {begin: each for begin, each in found.items() if each > MOST_EXPOSED[begin]}
    assert not worse, f"more exposed than they were: {worse}"
    return ", ".join(f"{begin}{'*' * (begin[-1] in '@-')} {each}" for begin, each in found.items())


def _exposure(machine: Machine, begin: str) -> float:
    listed = machine.run(f"systemctl list-units --no-legend --plain '{begin}*'")
    unit = listed.split()[0]
    said = machine.run(f"systemd-analyze security --no-pager {unit}")
    return float(said.strip().splitlines()[-1].split()[-3])
