"""Fifty yanks at random moments, coming and at work: nothing is left, and the next stick works."""

from __future__ import annotations

import random
import time
from collections import Counter
from pathlib import Path
from typing import Any

from tests.daemon.plugins import talker
from tests.lab.followed import Followed
from tests.lab.lab import Lab
from tests.lab.leftovers import Seen, seen, until_as_before

SEED = 20_221
YANKS = 50
PORTS = 8
"""Each time the next one: a port where sticks come and go in seconds is made to wait."""
AT_WORK = 0.25
"""Share of the time that goes by after a stick would have been at work."""
PAYLOAD = "org.example.talker"
EVENTS = {
    "DriveInserted": "told",
    "DriveRead": "read",
    "PayloadFound": "found",
    "PayloadCopied": "copied",
    "PayloadVerified": "verified",
    "WheelsStored": "stored",
    "ComponentsProbed": "probed",
    "PayloadActivated": "at work",
}
"""How far a stick had come, by the last of these events."""


def run(lab: Lab) -> str:
    """Measure how long a stick takes, then pull it at moments all over that time, and after."""
    host = Followed.follow(lab.host())
    image = lab.stick("talker", talker())
    before = host.machine.until("an answer", lambda: seen(host))
    coming_s = _calm(host, image, before)
    chance = random.Random(SEED)
    moments_s = [
        (number + chance.random()) / YANKS * coming_s / (1 - AT_WORK) for number in range(YANKS)
    ]
    chance.shuffle(moments_s)
    for number, moment_s in enumerate(moments_s):
        _yank(host, image, moment_s, port=str(1 + number % PORTS))
        until_as_before(host, before)
    phases = _phases(host)
    assert sum(phases.values()) >= 1, "nothing was ever told"
    _calm(host, image, before)
    hit = ", ".join(f"{count} {phase}" for phase, count in phases.most_common())
    return f"{YANKS} yanks in {coming_s / (1 - AT_WORK):.0f} s of a stick's life: {hit}"


def _calm(host: Followed, image: Path, before: Seen) -> float:
    """Bring the stick, take it away when it works; answers how long it took to be at work."""
    began = time.monotonic()
    stick = host.bring(image, PAYLOAD)
    coming_s = time.monotonic() - began
    host.machine.pull(stick)
    until_as_before(host, before)
    return coming_s


def _yank(host: Followed, image: Path, moment_s: float, port: str) -> None:
    stick = host.machine.plug(image, port=port)
    time.sleep(moment_s)  # the moment is what is tried, whatever the machine is at
    host.machine.pull(stick)


def _phases(host: Followed) -> Counter[str]:
    """What the sticks had come to when they were pulled, by the journal; `unseen` never got in."""
    rows: list[dict[str, Any]] = host.machine.attempt("nondum journal --json --limit 5000").json()
    phases: Counter[str] = Counter()
    phase = ""
    for row in rows:
        phase = EVENTS.get(row["event"], phase)
        if row["event"] == "DriveRemoved" and phase:
            phases[phase] += 1
            phase = ""
    phases["at work"] -= 1  # the calm one
    phases["unseen"] = YANKS - sum(phases.values())
    return +phases
