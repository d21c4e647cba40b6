"""Ten sticks at once, most of them behind hubs: each is at work, or people are told why not."""

from __future__ import annotations

from typing import Any

from tests.lab.machines import images
from tests.lab.machines.lab import Lab
from tests.lab.machines.plugins import doer

GOOD = tuple(f"crowd{letter}" for letter in "abcdefgh")
HUBS = ("7", "8")


def run(lab: Lab) -> str:
    """Eight with payloads, a blank one and one with photographs."""
    host = lab.host()
    hubs = [host.machine.plug_hub(port) for port in HUBS]
    sticks = [lab.stick(name, doer(name, "pass")) for name in GOOD]
    folder = lab.folder()
    sticks.insert(3, images.blank(folder / "blank.img"))
    sticks.insert(6, images.file_system(folder / "empty.img", "exfat"))
    ports = ["1", "2", *(f"{hub}.{port}" for hub in HUBS for port in range(1, 5))]
    for image, port in zip(sticks, ports, strict=True):
        host.machine.plug(image, port=port)
    wanted = {f"org.example.{name}" for name in GOOD}

    def settled(view: dict[str, Any]) -> dict[str, Any] | None:
        states = {row["payload"]: row["state"] for row in view["payloads"]}
        is_told = sum(bool(drive["problems"]) for drive in view["drives"]) == 2
        return view if is_told and states == dict.fromkeys(wanted, "active") else None

    view = host.until("all at work, or told", settled)
    codes = {problem.split()[0] for drive in view["drives"] for problem in drive["problems"]}
    assert codes == {"FS_UNSUPPORTED", "DRIVE_NOT_PAYLOAD"}, codes
    for hub in hubs:
        host.machine.unplug(hub)
    left = {f"org.example.{name}" for name in GOOD[:2]}

    def fewer(view: dict[str, Any]) -> bool | None:
        return True if {row["payload"] for row in view["payloads"]} == left else None

    host.until("only those of the machine's own ports", fewer)
    return f"{len(sticks)} at once, {len(wanted)} at work; {len(sticks) - 2} gone with their hubs"
