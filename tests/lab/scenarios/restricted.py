"""Where user namespaces are forbidden, the service's workers are restricted; more is refused."""

from __future__ import annotations

from typing import Any

from tests.daemon.plugins import talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab

PAYLOAD, STRICT = "org.example.talker", "org.example.strict"


def run(lab: Lab) -> str:
    """Forbid user namespaces, plug, kill the daemon, plug what demands more, pull."""
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
    confinement = host.until("its level", lambda view: view)["confinement"]
    assert confinement["level"] == "restricted", confinement
    stick = host.bring(lab.stick("talker", talker()), PAYLOAD)
    worker = _worker(host)
    host.machine.run("systemctl kill --kill-who=main -s KILL nondum.service")
    host.machine.until("the worker's end", lambda: None if worker in _workers(host) else True)
    host.until_payload(PAYLOAD, "active")
    strict = lab.stick("strict", talker("strict"), requires='confinement = "sandboxed"')
    other = host.machine.plug(strict)
    codes = host.until("a refusal", lambda view: _codes(view, STRICT))
    assert codes == ["CONFINEMENT"], codes
    host.machine.pull(other)
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    host.machine.until("no worker is left", lambda: None if _workers(host) else True)
    return str(confinement["level"])


def _worker(host: Installed) -> str:
    """The process of the talker's worker."""
    row = host.until_component("talker", "ready")
    assert row["confinement"] == "restricted", row
    return str(row["pid"])


def _workers(host: Installed) -> list[str]:
    """Processes of workers of talkers."""
    return host.machine.attempt("pgrep -x talker").out.split()


def _codes(view: dict[str, Any], payload: str) -> list[str] | None:
    """Why a payload was refused, once it was."""
    rows = [row for row in view["payloads"] if row["payload"] == payload]
    codes: list[str] = rows[0]["codes"] if rows else []
    return codes or None
