"""A host starts as a service of systemd, and has its workers sandboxed."""

from __future__ import annotations

from tests.lab.installed import Installed
from tests.lab.lab import Lab


def run(lab: Lab) -> str:
    """Start it, look at its status and at systemd's."""
    return see(lab.host())


def see(host: Installed) -> str:
    """What systemd and nondum say of a service that has started."""
    shown = host.machine.run("systemctl is-active nondum.service").strip()
    assert shown == "active", shown
    view = host.until("a status", lambda view: view)
    assert view["host"] == "spot"
    level = view["confinement"]["level"]
    assert level == "sandboxed", view["confinement"]
    return f"{view['state']}, {level}"
