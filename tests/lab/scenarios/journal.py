"""What happens on a host is found in systemd's journal: by payload, component, drive and code."""

from __future__ import annotations

import json

from tests.daemon.plugins import scribe, talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab

TOO_MUCH = "memory_mb = 1000000"
"""More than the machine has."""


def run(lab: Lab) -> str:
    """Plug in a stick that works and one that is refused; look for both."""
    host = lab.host()
    good = host.bring(lab.stick("talker", talker()), "org.example.talker")
    bad = host.machine.plug(lab.stick("scribe", scribe(), requires=TOO_MUCH))
    (refused, *_) = _entries(host, "NONDUM_CODE=NO_MEMORY")
    assert refused["NONDUM_PAYLOAD"] == "org.example.scribe", refused
    assert refused["PRIORITY"] == "4", refused
    assert refused["_SYSTEMD_UNIT"] == "nondum.service", refused
    assert "NO_MEMORY" in refused["MESSAGE"], refused
    at_work = _entries(host, "NONDUM_PAYLOAD=org.example.talker")
    assert any(entry["NONDUM_EVENT"] == "PayloadActivated" for entry in at_work), at_work
    (plugged, *_) = _entries(host, "NONDUM_EVENT=DriveInserted")
    drive = plugged["NONDUM_DRIVE"]
    host.machine.pull(good)
    host.machine.pull(bad)
    _entries(host, "NONDUM_EVENT=DriveRemoved", f"NONDUM_DRIVE={drive}")
    return refused["MESSAGE"]


def _entries(host: Installed, *matches: str) -> list[dict[str, str]]:
    """The entries that match, once there are any."""

    def found() -> list[dict[str, str]] | None:
        said = host.machine.run(f"journalctl -b -o json -u nondum.service {' '.join(matches)}")
        return [json.loads(line) for line in said.splitlines()] or None

    return host.machine.until(" ".join(matches), found)
