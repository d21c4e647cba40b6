"""A daemon that dies again and again is started in safe mode, says so, and leaves it by order."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.installed import SERVICE, Installed
from tests.lab.lab import Lab

PAYLOAD = "org.example.talker"
KILLS = 8
PATIENCE_S = 3000.0
"""Eight starts of an emulated machine that others share."""
CRASH_LOOP = f"""
for kill in $(seq {KILLS}); do
    until pid=$(systemctl show --value -p MainPID {SERVICE}) && [ "$pid" != 0 ] \\
        && [ "$pid" != "$last" ] && [ "$(cat /var/lib/nondum/deaths 2>/dev/null)" = "$kill" ]
    do sleep 0.1; done
    last=$pid
    kill -KILL "$pid"
done
"""
"""Kills each daemon as soon as it has counted itself."""


def run(lab: Lab) -> str:
    """A stick works; daemons are killed as they start; the stick is left alone, then taken in."""
    host = lab.host()
    stick = host.bring(lab.stick("talker", talker()), PAYLOAD)
    host.stop()
    host.machine.run(f"systemctl --no-block start {SERVICE}")
    host.machine.run(CRASH_LOOP, timeout_s=PATIENCE_S)
    view = host.until("safe mode", lambda view: view if view["safe_mode"] == "initial" else None)
    assert view["state"].startswith("safe mode"), view["state"]
    host.until("the stick is left alone", lambda view: _left_alone(view["drives"]))
    host.until("its payload, too", lambda view: _left_alone(view["payloads"]))
    assert host.machine.run("nondum components --json").strip() == "[]"
    words = host.machine.until("the status text", lambda: _status_text(host))
    (entry, *_) = host.machine.run("journalctl -b -o cat NONDUM_CODE=SAFE_MODE").splitlines()
    host.machine.run("nondum host resume")
    host.until_payload(PAYLOAD, "active")
    host.machine.pull(stick)
    return f"{words} ({entry})"


def _left_alone(rows: list[dict[str, list[str]]]) -> bool | None:
    """Whether all of them are, and there are some."""
    said = [problem for row in rows for problem in row["problems"]]
    return True if said and all("SAFE_MODE" in problem for problem in said) else None


def _status_text(host: Installed) -> str | None:
    shown = host.shown("StatusText")
    return shown if shown.startswith("safe mode") else None
