"""The service starts at boot, tells systemd how it is, and is started again whatever ends it."""

from __future__ import annotations

from tests.lab.installed import SERVICE, Installed
from tests.lab.lab import Lab

KILLS = 6
"""One more than systemd allows by itself before it gives up."""

DROP_IN = f"/etc/systemd/system/{SERVICE}.d/watched.conf"
"""As it is delivered: other scenarios allow for slow machines."""


def run(lab: Lab) -> str:
    """Restart the machine; kill the daemon again and again; stop it, so that it hangs."""
    host = lab.booted()
    host.machine.put(DROP_IN, "[Service]\nWatchdogSec=60\n")
    host.machine.reset()
    _until_shown(host, "ActiveState", "active")
    words = _until_shown(host, "StatusText", "at work")
    assert host.shown("Type") == "notify"
    assert host.shown("StartLimitIntervalUSec") == "0", "it would give up"
    assert host.shown("LimitCORE") == "0", "dumps would fill the disk"
    wants = host.machine.run(f"systemctl show --value -p Wants -p Requires {SERVICE}").split()
    assert not [unit for unit in wants if "online" in unit or "time" in unit], wants
    for _ in range(KILLS):
        _end(host, "KILL")
    _until_shown(host, "StatusText", "at work")
    _end(host, "STOP")
    said = host.machine.run(f"journalctl -b -o cat -u {SERVICE} -u init.scope | tail -n 200")
    assert "Watchdog timeout" in said, said[-2000:]
    assert "Fatal Python error: Aborted" in said, f"it does not say where it hung\n{said[-2000:]}"
    _until_shown(host, "StatusText", "at work")
    return f"{host.shown('NRestarts')} restarts; status: {words}"


def _end(host: Installed, signal: str) -> None:
    """Send the daemon a signal, and wait until another one runs in its place."""
    before = host.machine.until("a daemon", lambda: _daemon(host))
    host.machine.run(f"kill -{signal} {before}")
    host.machine.until(f"another daemon after SIG{signal}", lambda: _other(host, before))


def _daemon(host: Installed) -> str | None:
    pid = host.shown("MainPID")
    return pid if pid != "0" else None


def _other(host: Installed, before: str) -> str | None:
    pid = _daemon(host)
    return pid if pid != before else None


def _until_shown(host: Installed, name: str, words: str) -> str:
    """Wait until systemd shows a property with some words in it; answers it."""

    def seen() -> str | None:
        shown = host.shown(name)
        return shown if words in shown else None

    return host.machine.until(f"{name}: {words}", seen)
