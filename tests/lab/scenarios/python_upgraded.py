"""Debian's Python becomes that of the next Debian: the service comes back by itself, with it."""

from __future__ import annotations

from tests.lab.debs import OLD, debs
from tests.lab.demonstration import kit
from tests.lab.drives import fat_stick
from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.newer_python import SUITE, newer_python
from tests.lab.recipe import PYTHONS
from tests.lab.robot import MachineRobot

PLUGIN, PAYLOAD = "mobile-base", "org.nondum.mobile-base"
UPGRADING_S = 1500.0
"""Thirty packages, their modules compiled by an emulated processor."""
RUNS_BY = "readlink /proc/$(systemctl show -P MainPID nondum.service)/exe"


def run(lab: Lab) -> str:
    """A machine of Debian 12, a payload with machine code for both Pythons, then apt with files of
    Debian 13."""
    if lab.built.recipe.suite == SUITE:
        return "nothing newer is known"
    machine = lab.bare(debs(lab.built), newer_python(lab.built))
    host = Installed(machine)
    host.be_patient()
    machine.run("mkdir -p /mnt/nondum /mnt/python")
    machine.run("mount -o ro /dev/vdb /mnt/nondum && mount -o ro /dev/vdc /mnt/python")
    machine.run(f"{_APT} dpkg -i /mnt/nondum/{OLD}", timeout_s=UPGRADING_S)
    host.configure()
    machine.run("systemctl restart nondum.service", timeout_s=UPGRADING_S)
    host.wait_until_started()
    made = kit(lab, [PLUGIN], {}, later=[PYTHONS[SUITE]])
    MachineRobot(host, {}).trust(made.trust)
    image = fat_stick(lab.folder() / "stick.img", made.drives[PLUGIN])
    stick = host.bring(image, PAYLOAD)
    before = machine.run(RUNS_BY).strip()
    machine.run(f"{_APT} apt-get -q -y install /mnt/python/*.deb", timeout_s=UPGRADING_S)
    host.wait_until_started()
    after = machine.run(RUNS_BY).strip()
    assert before != after == machine.run("readlink -f /usr/bin/python3").strip(), (before, after)
    assert host.shown("NRestarts") == "0", host.journal[-4000:]
    host.until_payload(PAYLOAD, "active")
    machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    return f"{before.rpartition('/')[2]}, then {after.rpartition('/')[2]}"


_APT = "DEBIAN_FRONTEND=noninteractive"
