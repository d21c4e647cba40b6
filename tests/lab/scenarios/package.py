"""The Debian package installs, upgrades, is removed and purged as its operator expects."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.debs import NEW, OLD, VERSIONS, debs
from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.machine import Machine

PAYLOAD = "org.example.talker"
UNITS = ("nondum.service", "nondum-helper.socket")
INSTALLING_S = 1500.0
"""All modules are compiled, by an emulated processor."""
LEFT = """
find / -xdev \\( -path /proc -o -path /sys \\) -prune -o -name '*nondum*' -print \
    | grep -v -e nondum-lab -e ^/mnt -e nondum.service.d || true
"""


def run(lab: Lab) -> str:
    """As its operator would: dpkg -i, configure, plug in; dpkg -i a newer one; dpkg -r; dpkg -P."""
    machine = lab.bare(debs(lab.built))
    host = Installed(machine)
    host.be_patient()
    machine.run("mount -o ro /dev/vdb /mnt")
    spent_s = _dpkg(machine, f"-i /mnt/{OLD}")
    _sees_it_run(host)
    host.configure()
    machine.run("systemctl restart nondum.service", timeout_s=INSTALLING_S)
    host.wait_until_started()
    image = lab.stick("talker", talker())
    machine.pull(host.bring(image, PAYLOAD))
    host.until_payload(PAYLOAD, "gone")
    known = _store(machine)
    _dpkg(machine, f"-i /mnt/{NEW}")
    _sees_it_run(host)
    assert known and _store(machine) == known, "what was installed is not known any more"
    _remembers(host)
    host.bring(image, PAYLOAD)
    _dpkg(machine, "-r nondum")
    _sees_it_stopped(machine)
    _dpkg(machine, "-P nondum")
    left = machine.run(LEFT).split()
    assert not left, f"purged, and left: {left}"
    return f"installed in {spent_s:.0f} s, emulated, without a network"


def _dpkg(machine: Machine, words: str) -> float:
    """Run dpkg without questions to a person; answers how many seconds that took."""
    uptime = "cut -d' ' -f1 /proc/uptime"
    before = float(machine.run(uptime))
    machine.run(f"DEBIAN_FRONTEND=noninteractive dpkg {words}", timeout_s=INSTALLING_S)
    return float(machine.run(uptime)) - before


def _sees_it_run(host: Installed) -> None:
    for unit in UNITS:
        assert host.machine.run(f"systemctl is-enabled {unit}").strip() == "enabled", unit
    assert host.machine.run("systemctl is-active nondum.service").strip() == "active"
    host.wait_until_started()
    assert host.shown("NRestarts") == "0", host.journal[-4000:]
    assert host.shown("User") == "nondum"


def _store(machine: Machine) -> set[str]:
    """The wheels that it keeps, by their folders' names, which are their hashes."""
    return set(machine.run("ls /var/lib/nondum/store").split())


def _remembers(host: Installed) -> None:
    """The newer one has its operator's configuration, and the journal of the older one."""
    version = host.machine.run("dpkg-query -W -f '${Version}' nondum")
    assert version == VERSIONS[NEW], version
    assert "startup_s" in host.machine.run("cat /etc/nondum/host.toml")
    journal = host.machine.run("nondum journal --limit 1000")
    assert journal.count("HostStarted") >= 2, "the journal of before is gone"


def _sees_it_stopped(machine: Machine) -> None:
    processes = machine.attempt("ps -o pid=,args= -u nondum").out.strip()
    assert not processes, f"removed, and runs: {processes}"
    mounts = machine.attempt("grep nondum /proc/mounts").out
    assert not mounts, f"removed, and mounted: {mounts}"
    assert not machine.run("ls /opt/nondum 2>/dev/null || true").split()
    machine.run("test -s /etc/nondum/host.toml && test -s /var/lib/nondum/catalogue.sqlite")
