"""A stick is pulled while its payload is brought in; nothing is left, and next time it works."""

from __future__ import annotations

from pathlib import Path

from tests.daemon.plugins import talker
from tests.lab.installed import REPLUGS, Installed
from tests.lab.lab import Lab
from tests.lab.scenarios import starts

PAYLOAD = "org.example.talker"
BEGUN = """
python3 -I - <<'END'
import ctypes, os
state, CREATE, MOVED_TO = "/var/lib/nondum", 0x100, 0x80
libc = ctypes.CDLL(None, use_errno=True)
def watch(folder):
    watching = libc.inotify_init()
    assert libc.inotify_add_watch(watching, folder.encode(), CREATE | MOVED_TO) >= 0, folder
    return watching
above, staging = watch(state), state + "/staging"
while not os.path.isdir(staging):
    os.read(above, 4096)
inside = watch(staging)
if not os.listdir(staging):
    os.read(inside, 4096)
END
"""
"""Returns with the first folder of a payload that is copied. It sleeps until then: to look again
and again would take the processor from the daemon that it waits for."""
BEGUN_S = 120.0


def run(lab: Lab) -> str:
    """Start, plug, pull at the first byte copied, look, plug again, pull, look."""
    host = lab.host()
    said = starts.see(host)
    image = lab.stick("talker", talker())
    _yank(host, image)
    host.until_payload(PAYLOAD, "gone")
    host.until("no drive", lambda view: True if not view["drives"] else None)
    _until_nothing_is_left(host)
    stick = host.bring(image, PAYLOAD)
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    _until_nothing_is_left(host)
    return f"{said}; the last that it had come to: {_reached(host)}"


def _yank(host: Installed, image: Path) -> None:
    """Pull it as soon as its files are copied; one that the processors had no time for is plugged
    in again (see `Installed.bring`)."""
    for attempt in range(REPLUGS):
        host.machine.replugs += attempt > 0
        stick = host.machine.plug(image)
        begun = host.machine.attempt(BEGUN, timeout_s=BEGUN_S)
        host.machine.pull(stick)
        if begun.status == 0:
            return
    raise AssertionError(f"nothing was copied from a drive that was plugged in {REPLUGS} times")


def _until_nothing_is_left(host: Installed) -> None:
    host.machine.until("nothing is staged or mounted", lambda: None if _left(host) else True)


def _left(host: Installed) -> str:
    staged = host.machine.run("ls /var/lib/nondum/staging")
    return staged + host.machine.attempt("grep -E '/nondum/.*mounts|usb' /proc/mounts").out


def _reached(host: Installed) -> str:
    """What was journalled last before the first drive was gone."""
    rows = host.machine.attempt("nondum journal --json --limit 1000").json()
    events = [row["event"] for row in rows]
    return str(events[max(events.index("DriveRemoved") - 1, 0)])
