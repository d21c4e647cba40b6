"""Where bubblewrap may make no rooms, workers are services of systemd: confined, and ended."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab

PAYLOAD = "org.example.talker"


def run(lab: Lab) -> str:
    """Forbid user namespaces, plug, look at the service, kill the daemon, pull."""
    lab.booted_once().machine.run(
        "sysctl -q -w kernel.unprivileged_userns_clone=0 user.max_user_namespaces=0"
    )
    try:
        return _run(lab)
    finally:
        lab.booted_once().machine.run(
            "sysctl -q -w kernel.unprivileged_userns_clone=1 user.max_user_namespaces=9000"
        )


def _run(lab: Lab) -> str:
    host = lab.host()
    level = host.until("its level", lambda view: view)["confinement"]["level"]
    assert level == 2, f"level {level}"
    stick = host.bring(lab.stick("talker", talker()), PAYLOAD)
    (unit,) = _services(host)
    host.machine.run("systemctl kill --kill-who=main -s KILL nondum.service")
    host.machine.until("the service's end", lambda: None if unit in _services(host) else True)
    host.until_payload(PAYLOAD, "active")
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    host.machine.until("no service is left", lambda: None if _services(host) else True)
    return f"level {level}"


def _services(host: Installed) -> list[str]:
    """Units of workers."""
    words = "systemctl list-units --no-legend --plain 'nondum-worker*'"
    return [line.split()[0] for line in host.machine.run(words).splitlines()]
