"""Every planner plans as the daemon's user, with the restrictions of the daemon's unit."""

from __future__ import annotations

from tests.lab.lab import Lab

PLANNERS = ("fast-downward", "native", "pyperplan")
DOMAIN = """(define (domain lamps) (:requirements :strips) (:predicates (lit ?l) (has ?l) (at ?l))
 (:action go :parameters (?a ?b) :precondition (at ?a) :effect (and (at ?b) (not (at ?a))))
 (:action light :parameters (?l) :precondition (and (at ?l) (has ?l)) :effect (lit ?l)))"""
PROBLEM = """(define (problem two) (:domain lamps) (:objects a b c)
 (:init (at a) (has b) (has c)) (:goal (and (lit b) (lit c))))"""
SAME_LIMITS = """
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
"""Runs a planner once as the daemon's user, with the restrictions of the daemon's unit."""


def run(lab: Lab) -> str:
    """Run each once in a unit like the daemon's; each is a separate process, or several."""
    machine = lab.booted_once().machine
    machine.put("/etc/plans/d.pddl", DOMAIN)
    machine.put("/etc/plans/p.pddl", PROBLEM)
    for planner in PLANNERS:
        said = machine.run(SAME_LIMITS.format(planner=planner))
        assert "light" in said, f"{planner}: {said}"
    return ", ".join(PLANNERS)
