"""An instrument is moved to other ports and behind hubs while it is read: it is read again."""

from __future__ import annotations

import json

from tests.lab.gauge import Gauge, reader, switched_on
from tests.lab.installed import Installed
from tests.lab.lab import Lab

PAYLOAD = "org.example.gauge"
GOAL = "(flowing spot__gauge__level)"
SERIAL = "GAUGE42"
MATCH = {"SUBSYSTEM": "tty", "ID_SERIAL_SHORT": SERIAL}
WAITS = "waits for line"


def run(lab: Lab) -> str:
    """A port, another one, behind a hub, behind a hub behind that; then where it was at first,
    under another name, since something else has taken its own."""
    host = lab.host()
    machine = host.machine
    host.bring(lab.stick("gauge", reader(MATCH)), PAYLOAD, port="1")
    host.until_component("gauge", WAITS)
    nodes = []
    with switched_on(lab.work / "gauge") as gauge:
        machine.run(f'nondum goal --maintain --pddl "{GOAL}"')
        hubs = [machine.plug_hub(port="4"), machine.plug_hub(port="4.3")]
        for port in ("2", "3", "4.2", "4.3.1"):
            line = machine.plug_line(gauge.path, port=port, serial=SERIAL)
            nodes.append(_read(host, gauge))
            machine.pull_line(line)
            _told(host)
        stranger = machine.plug_line(serial="STRANGER")  # takes the name that the gauge had
        machine.until("the stranger", lambda: True if _node(host, "STRANGER") else None)
        line = machine.plug_line(gauge.path, port="2", serial=SERIAL)
        nodes.append(_read(host, gauge))
        assert nodes[-1] != nodes[-2], f"it has the name it had: {nodes}"
        opened = _openers(host, _node(host, "STRANGER"))
        assert not opened, f"a process opened the stranger: {opened}"
        assert _openers(host, nodes[-1]), "no process has the gauge open"
        for name in (line, stranger):
            machine.pull_line(name)
        _told(host)
    for hub in reversed(hubs):
        machine.unplug(hub)
    return f"nodes {', '.join(nodes)}"


def _read(host: Installed, gauge: Gauge) -> str:
    """Wait until its stream carries what the gauge counts now, which only its line tells; answers
    its node."""
    before = gauge.count
    host.until_goal(GOAL, "holds")
    follow = "nondum streams --follow spot__gauge__level --count 1 --json"

    def is_fresh() -> bool | None:
        seen = host.machine.attempt(follow, timeout_s=60)
        if seen.status != 0 or not seen.out.strip():
            return None
        value = json.loads(seen.out)["fields"]["value"]
        assert value <= gauge.count, f"{value} was never counted"
        return True if value >= before else None

    host.machine.until("what it counts now", is_fresh)
    return _node(host, SERIAL)


def _told(host: Installed) -> None:
    """See that the behaviour ended, and that `nondum why` says what is missing."""
    host.until_component("gauge", WAITS)
    host.until_goal(GOAL, "suspended")
    said = host.machine.run(f'nondum why "{GOAL}"; nondum why')
    assert "(ready spot__gauge__gauge) does not hold" in said, said
    assert "gauge waits for its device line" in said, said
    rows = json.loads(host.machine.run("nondum journal --subject gauge --limit 30 --json"))
    ends = [row["detail"] for row in rows if row["event"] == "BehaviourEnded"]
    assert ends[-1]["outcome"] in ("FAILED", "HALTED"), ends[-1]
    started = [row["event"] for row in rows if row["event"].startswith("Behaviour")]
    assert started[-1] == "BehaviourEnded", started


def _node(host: Installed, serial: str) -> str:
    """The node of an adapter, by udev's link to it."""
    link = f"/dev/serial/by-id/*_{serial}-*"
    return host.machine.attempt(f"readlink -e {link}").out.strip()


def _openers(host: Installed, node: str) -> str:
    """Open descriptors of that device, whatever it is called in the sandboxes of workers."""
    number = host.machine.run(f"stat -c %t:%T {node}").strip()
    every = "stat -L -c '%t:%T %n' /proc/[0-9]*/fd/* 2>/dev/null"
    return host.machine.attempt(f"{every} | grep '^{number} '").out.strip()
