"""Another stick at the same node, the same one again, at another port, behind a hub: each works."""

from __future__ import annotations

import shutil
import time
from functools import partial
from pathlib import Path
from typing import Any

from tests.lab.followed import Followed
from tests.lab.lab import Lab
from tests.lab.plugins import doer

HOT = 3
"""How often the same stick is pulled and plugged in again as fast as can be."""


def run(lab: Lab) -> str:
    """Swap sticks without waiting for the host to see that one is gone."""
    host = Followed.follow(lab.host())
    one, other = (lab.stick(name, doer(name, "pass")) for name in ("one", "other"))
    stick = host.bring(one, "org.example.one", port="1")
    first = _next(host, "")
    began = time.monotonic()
    host.machine.pull(stick)
    stick = host.machine.plug(other, port="1")
    swapped_s = time.monotonic() - began
    second = _next(host, first)
    host.until_payload("org.example.other", "active")
    host.until_payload("org.example.one", "gone")
    for _ in range(HOT):
        host.machine.pull(stick)
        stick = host.machine.plug(other, port="1")
    last = _next(host, second)
    host.until_payload("org.example.other", "active")
    host.machine.pull(stick)
    stick = host.machine.plug(other, port="3")
    _next(host, last)
    host.until_payload("org.example.other", "active")
    twin = shutil.copy(other, other.with_name("twin.img"))
    _see_two_sources(host, Path(twin), stick)
    hub = host.machine.plug_hub("4")
    host.bring(one, "org.example.one", port="4.2")
    host.machine.unplug(hub)
    for payload in ("org.example.one", "org.example.other"):
        host.until_payload(payload, "gone")
    return f"{first} then {second}, swapped within {swapped_s:.1f} s"


def _see_two_sources(host: Followed, twin: Path, stick: str) -> None:
    """The same payload on two sticks is one, and goes with the second."""
    second = host.machine.plug(twin, port="5")
    host.until("two drives", partial(_idle, 2))
    host.machine.pull(stick)
    host.until("one drive", partial(_idle, 1))
    host.until_payload("org.example.other", "active")
    host.machine.pull(second)
    host.until_payload("org.example.other", "gone")


def _idle(count: int, view: dict[str, Any]) -> bool | None:
    states = [drive["state"] for drive in view["drives"]]
    return True if states == ["idle"] * count else None


def _next(host: Followed, before: str) -> str:
    """The name of the only drive (its node and the number of its insertion), once it is another one
    than before, and has been read."""

    def found(view: dict[str, Any]) -> str | None:
        (drive,) = view["drives"] if len(view["drives"]) == 1 else ({"drive": before},)
        is_next = drive["drive"] != before and drive["state"] == "idle"
        return str(drive["drive"]) if is_next else None

    return host.until("the next drive", found)
