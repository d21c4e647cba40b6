"""A plugin that takes memory without end is ended by itself."""

from __future__ import annotations

from typing import Any

from tests.daemon.plugins import talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.plugins import hogs

LIMITS = "memory_mb = 128\n"


def run(lab: Lab) -> str:
    """The hog is ended with its code, and nothing else is."""
    host = lab.host(more=LIMITS)
    images = {"talker": lab.stick("talker", talker()), "hogs": lab.stick("hogs", hogs())}
    sticks = [host.bring(image, f"org.example.{name}") for name, image in images.items()]
    daemon = host.shown("MainPID")
    host.machine.run('nondum goal --pddl "(hogs-done self)"', timeout_s=120)
    code = host.machine.until("the worker's end", lambda: _code(host))
    assert code == "WORKER_OOM", code
    assert host.shown("MainPID") == daemon, "the daemon went, too"
    talkers = [row for row in _components(host) if row["component"] == "talker"]
    assert talkers[0]["state"] == "ready", talkers
    for stick in sticks:
        host.machine.pull(stick)
    return code


def _code(host: Installed) -> str | None:
    """Why the worker ended, once it has."""
    said = host.machine.run("nondum journal --json --subject hogs", timeout_s=120)
    return next((code for code in ("WORKER_OOM", "WORKER_EXITED") if code in said), None)


def _components(host: Installed) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = host.machine.attempt("nondum components --json").json()
    return rows
