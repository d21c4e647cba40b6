"""The daemon is no root: stick, device, goal and their ends go by the helper; planners plan."""

from __future__ import annotations

from tests.lab.machines.installed import Installed
from tests.lab.machines.lab import Lab
from tests.lab.plugins import GAUGE
from tests.payloads import Part

PAYLOAD = "org.example.gauge"
GOAL = "(measured spot)"
MATCH = {"ID_MODEL": "QEMU_USB_SERIAL", "SUBSYSTEM": "tty"}
PLANNERS = ("fast-downward", "native", "pyperplan")
DOMAIN = """(define (domain lamps) (:requirements :strips) (:predicates (lit ?l) (has ?l) (at ?l))
 (:action go :parameters (?a ?b) :precondition (at ?a) :effect (and (at ?b) (not (at ?a))))
 (:action light :parameters (?l) :precondition (and (at ?l) (has ?l)) :effect (lit ?l)))"""
PROBLEM = """(define (problem two) (:domain lamps) (:objects a b c)
 (:init (at a) (has b) (has c)) (:goal (and (lit b) (lit c))))"""
SAME_WALLS = """
set -eu
sed -e '/^ExecStart=/d' -e '/^Restart/d' -e '/^TimeoutStop/d' -e '/^State/d' -e '/^Runtime/d' \
    /etc/systemd/system/nondum.service >/run/systemd/system/nondum-plans.service
cat >>/run/systemd/system/nondum-plans.service <<END
[Service]
Type=oneshot
ExecStart=/opt/nondum/bin/nondum pddl plan --planner {planner} --json /etc/plans/d.pddl \
    /etc/plans/p.pddl
StandardOutput=truncate:/run/plan.json
END
systemctl daemon-reload
systemctl start nondum-plans.service
cat /run/plan.json
"""
"""Has a planner run once as the daemon's user, with all that holds the daemon."""


def run(lab: Lab) -> str:
    """At each level that a service has: with a device that comes before the payload, and after."""
    planned = _planned(lab.host())
    return f"levels {', '.join(_at(lab, level) for level in '321')}; plans by {', '.join(planned)}"


def _at(lab: Lab, level: str) -> str:
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
    machine.run("pgrep -u nondum -f planner_child")  # who planned it is kept
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
    left = machine.run("ls -A /run/nondum-helper/devices").split()
    assert not left, f"nodes are left: {left}"
    return level


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
    """Processes and services of workers."""
    services = host.machine.run("systemctl list-units --no-legend --plain 'nondum-worker*'")
    return services + host.machine.attempt("pgrep -fa 'gauge'").out


def _planned(host: Installed) -> list[str]:
    """The planners that found a plan; each is a process of its own, and one starts others."""
    host.machine.put("/etc/plans/d.pddl", DOMAIN)
    host.machine.put("/etc/plans/p.pddl", PROBLEM)
    for planner in PLANNERS:
        said = host.machine.run(SAME_WALLS.format(planner=planner))
        assert "light" in said, f"{planner}: {said}"
    return list(PLANNERS)
