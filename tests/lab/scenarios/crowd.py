"""Ten sticks at once, most of them behind hubs: each is at work, or people are told why not."""

from __future__ import annotations

from typing import Any

from tests.lab import images
from tests.lab.followed import Followed, Stick
from tests.lab.lab import Lab
from tests.lab.plugins import doer

HUBS = ("7", "8")
PORTS = {
    **{"alder": "1", "birch": "7.1", "cedar": "7.2", "elm": "7.3"},
    **{"fir": "8.1", "hazel": "8.2", "larch": "8.3", "maple": "8.4"},
}
"""Payload → port."""


def run(lab: Lab) -> str:
    """Eight with payloads, a blank one and one with photographs."""
    host = Followed.follow(lab.host())
    hubs = [host.machine.plug_hub(port) for port in HUBS]
    folder = lab.folder()
    others = [
        Stick(images.blank(folder / "blank.img"), "2"),
        Stick(images.file_system(folder / "empty.img", "exfat"), "7.4"),
    ]
    for stick in others:
        host.machine.plug(stick.image, port=stick.port)
    host.bring_all(
        {
            f"org.example.{name}": Stick(lab.stick(name, doer(name, "pass")), port)
            for name, port in PORTS.items()
        }
    )

    def told(view: dict[str, Any]) -> list[str] | None:
        codes = [problem.split()[0] for drive in view["drives"] for problem in drive["problems"]]
        return sorted(codes) if len(codes) == len(others) else None

    codes = host.until("what is wrong with two of them", told)
    assert codes == ["DRIVE_NOT_PAYLOAD", "FS_UNSUPPORTED"], codes
    for hub in hubs:
        host.machine.unplug(hub)

    def fewer(view: dict[str, Any]) -> bool | None:
        return (
            True if [row["payload"] for row in view["payloads"]] == ["org.example.alder"] else None
        )

    host.until("only that of the machine's own port", fewer)
    return f"{len(PORTS)} at work, {len(others)} told, {len(PORTS) - 1} gone with their hubs"
