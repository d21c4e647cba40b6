"""Power is cut at each step of a payload's coming and going; every boot finds things clean."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.daemon.plugins import talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab

PAYLOAD = "org.example.talker"
STEPS = (
    *("received", "copied", "verified", "removing"),
    *("staged", "stored", "probed", "active"),
)
"""In this order there are never five cuts without a payload that came to life in between: after so
many the drive would be left alone. After eight without a minute of peace the host would enter safe
mode."""
SEEN = "/run/seen"
WATCH = """
import os, signal, sqlite3, sys
wanted, pid = sys.argv[1], int(sys.argv[2])
order = "received copied verified staged stored probed active removing".split()
catalogue = sqlite3.connect("file:/var/lib/nondum/catalogue.sqlite?mode=ro", uri=True)

def step():
    row = catalogue.execute("SELECT step FROM payloads").fetchone()
    return row[0] if row else None

while True:
    found = step()
    if found in order and order.index(found) >= order.index(wanted):
        os.kill(pid, signal.SIGSTOP)
        with open("/run/seen.new", "w") as seen:
            seen.write(step() or "gone")
        os.rename("/run/seen.new", "/run/seen")
        break
"""
"""Holds the daemon as soon as its catalogue has the step, and tells at which one it is held: it
may have come further while it was being told. It reads as fast as it can: some steps are short."""
LOOK = """
import json, os, sqlite3
state = "/var/lib/nondum/"
catalogue = sqlite3.connect(f"file:{state}catalogue.sqlite?mode=ro", uri=True)
folders = ("staging", "mounts", "venvs", "payloads", "scratch")
print(json.dumps({
    "whole": catalogue.execute("PRAGMA integrity_check").fetchone()[0],
    "steps": [row[0] for row in catalogue.execute("SELECT step FROM payloads")],
    **{f: os.listdir(state + f) if os.path.isdir(state + f) else [] for f in folders},
}))
"""
DEATHS = "/var/lib/nondum/deaths"
"""How many daemons in a row ended soon; gone once one has lived for a minute."""
NOTHING: dict[str, Any] = {
    **{"whole": "ok", "steps": []},
    **{"staging": [], "mounts": [], "venvs": [], "payloads": [], "scratch": []},
}


def run(lab: Lab) -> str:
    """At each step: plug, hold, cut, boot, look. The stick is pulled while there is no power."""
    host = lab.booted()
    image = lab.stick("talker", talker())
    host.start()
    cuts = [_cut_at(host, image, step) for step in STEPS[:4]]
    host.machine.until("a minute of peace", lambda: _is_at_peace(host) or None)
    cuts += [_cut_at(host, image, step) for step in STEPS[4:]]
    stick = host.bring(image, PAYLOAD)
    host.until("the drive is done with", lambda v: v["drives"][0]["state"] == "idle" or None)
    found = _look(host)
    assert found["whole"] == "ok", found
    assert found["steps"] == ["active"], found
    assert (len(found["payloads"]), len(found["venvs"])) == (1, 1), found
    assert (found["staging"], found["mounts"]) == ([], []), found
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    assert _look(host) == NOTHING, _look(host)
    return f"cut at {', '.join(cuts)}"


def _cut_at(host: Installed, image: Path, step: str) -> str:
    """Answers the step at which power was cut, as the catalogue had it then."""
    machine = host.machine
    machine.put("/root/watch.py", WATCH)
    stick = host.bring(image, PAYLOAD) if step == "removing" else ""
    pid = host.shown("MainPID")
    machine.run(
        f"rm -f {SEEN}; nohup python3 -I /root/watch.py {step} {pid} >/run/watch.log 2>&1 &"
    )
    if step == "removing":
        machine.pull(stick)
    else:
        machine.plug(image)
    seen = machine.until(f"{step} is reached", lambda: _said(host))
    machine.cut_power()
    machine.boot()
    host.wait_until_started()
    host.until_payload(PAYLOAD, "gone")
    machine.until(f"nothing is left of {step}", lambda: _look(host) == NOTHING or None)
    return seen if seen == step else f"{seen} ({step} had passed)"


def _is_at_peace(host: Installed) -> bool:
    return host.machine.attempt(f"test -e {DEATHS}").status != 0


def _said(host: Installed) -> str | None:
    seen = host.machine.attempt(f"cat {SEEN}")
    return seen.out or None


def _look(host: Installed) -> dict[str, Any]:
    host.machine.put("/root/look.py", LOOK)
    found: dict[str, Any] = json.loads(host.machine.run("python3 -I /root/look.py"))
    return found
