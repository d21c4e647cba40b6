"""The daemon is no root: a stick, a device and a goal come, are used and go, at each level."""

from __future__ import annotations

from tests.daemon.plugins import GAUGE
from tests.kit.payloads import Part
from tests.lab.installed import Installed
from tests.lab.lab import Lab

from nondum.wheelhouse.format.confinement import Level

PAYLOAD = "org.example.gauge"
GOAL = "(measured spot)"
MATCH = {"ID_MODEL": "QEMU_USB_SERIAL", "SUBSYSTEM": "tty"}


def run(lab: Lab) -> str:
    """The device comes after the payload, is pulled, comes again; the stick is pulled."""
    return ", ".join(_at(lab, level) for level in (Level.SANDBOXED, Level.RESTRICTED))


def _at(lab: Lab, level: Level) -> str:
    host = lab.host(more=f'confinement = "{level}"\n')
    machine = host.machine
    assert machine.run(f"ps -o user= -p {host.shown('MainPID')}").strip() == "nondum"
    machine.run("modprobe -r ftdi_sio || true")  # its driver is loaded once it is plugged in
    stick = host.bring(lab.stick("gauge", _gauge()), PAYLOAD)
    host.until_component("gauge", "waits for gauge")
    line = machine.plug_line()
    _see_granted(host)
    machine.run(f'nondum goal --maintain --pddl "{GOAL}"')
    host.until_goal(GOAL, "holds")
    machine.run("pgrep -u nondum -f planner_child")  # their fork server is kept
    machine.pull_line(line)
    host.until_component("gauge", "waits for gauge")
    host.until_goal(GOAL, "suspended")
    said = machine.run(f'nondum why "{GOAL}"')
    assert "gauge" in said, said
    line = machine.plug_line()
    host.until_goal(GOAL, "holds")
    machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    machine.pull_line(line)
    machine.until("no worker is left", lambda: None if _workers(host) else True)
    left = machine.run("find /run/nondum-helper/devices -type c").split()
    assert not left, f"nodes are left: {left}"
    return str(level)


def _gauge() -> Part:
    """Listens to a serial adapter."""
    match = ", ".join(f'{name} = "{value}"' for name, value in MATCH.items())
    need = f'[[component.device]]\nname = "gauge"\nmatch = {{ {match} }}\n'
    return Part("gauge", GAUGE.replace('{"ID_MODEL": "Gauge"}', repr(MATCH)), manifest=need)


def _see_granted(host: Installed) -> None:
    """It has the device, which the daemon's user could not have opened."""
    row = host.until_component("gauge", "ready")
    assert row["devices"], row
    refused = host.machine.attempt("runuser -u nondum -- cat /dev/ttyUSB0 </dev/null", timeout_s=5)
    assert "Permission denied" in refused.err, str(refused)


def _workers(host: Installed) -> str:
    """Processes of workers."""
    return host.machine.attempt("pgrep -x gauge").out
