"""With real udev, drives of each kind are told and read as what they are; own disks left alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.lab import images
from tests.lab.lab import Lab
from tests.lab.machine import Machine
from tests.lab.plugins import doer

WATCH = """
import asyncio, json
from pathlib import Path
from nondum.host.sandbox.helper import mounting
from nondum.host.sources.drives.blocks import BlockSource
from nondum.sdk.errors import NondumError
from nondum.wheelhouse.payload import drive

def tell(event):
    said = {"event": event.name, "drive": getattr(event, "drive", "")}
    said["codes"] = [problem.code for problem in getattr(event, "problems", ())]
    said["why"] = [str(problem) for problem in getattr(event, "problems", ())]
    if event.name == "DriveInserted" and not said["codes"]:
        try:
            mounting.mount(event.node, event.root, event.filesystem, drive=event.drive)
            found = drive.find_payloads(event.root)
            said["files"] = {folder.name: len(drive.read_contents(folder)) for folder in found}
            mounting.unmount(event.root)
        except NondumError as error:
            said["codes"] = [problem.code for problem in error.problems]
    print(json.dumps(said), flush=True)

asyncio.run(BlockSource(Path("/run/lab-mounts")).watch(tell))
"""
"""The source that the daemon has, and what its child does first, without daemon and helper."""


def run(lab: Lab) -> str:
    """Plug in, in turn: what the machine needs, every file system, several partitions, a swap."""
    machine = lab.booted().machine
    machine.put("/run/watch.py", WATCH)
    folder = lab.folder()
    own = images.file_system(folder / "own.img", "ext4", label="OURS")
    own_disk = machine.plug(images.partitioned(folder / "own-disk.img", "gpt", [own, None]))
    machine.until("the own disk", lambda: _is_there(machine, "OURS"))
    machine.run("mkdir -p /srv/data && mount LABEL=OURS /srv/data")
    machine.run(
        "systemd-run -q --unit watch -p StandardOutput=file:/run/told "
        "/opt/nondum/bin/python /run/watch.py"
    )
    left = _until(machine, 3)
    assert [row["codes"] for row in left[:2]] == [["DRIVE_OWN"]] * 2, left
    assert left[2]["event"] == "DrivesScanned", left
    for kind in images.FILE_SYSTEMS:
        _see_read(lab, machine, kind)
    _see_several(lab, machine)
    _see_told(machine, images.blank(folder / "blank.img"), "FS_UNSUPPORTED")
    _see_told(machine, images.file_system(folder / "swap.img", "swap"), "FS_UNSUPPORTED")
    swapped = _see_swapped(lab, machine)
    machine.run("touch /srv/data/well")
    machine.pull(own_disk)
    assert not machine.run("grep /run/lab-mounts /proc/mounts || true")
    return f"{', '.join(images.FILE_SYSTEMS)} read; {swapped}"


def _see_read(lab: Lab, machine: Machine, kind: str) -> None:
    content = images.with_litter(lab.payload(kind, doer(kind, "pass")))
    image = images.file_system(
        content.parent / "disk.img", kind, content, label=images.ODD_LABELS[kind]
    )
    count = len(_told(machine))
    stick = machine.plug(image)
    (row,) = _until(machine, count + 1)[count:]
    assert row["files"] == _contents(content), row
    machine.pull(stick)
    (gone,) = _until(machine, count + 2)[count + 1 :]
    assert (gone["event"], gone["drive"]) == ("DriveRemoved", row["drive"]), gone


def _see_several(lab: Lab, machine: Machine) -> None:
    """Payloads on the first and the third partition; nothing on the others."""
    first, third = (lab.payload(name, doer(name, "pass")) for name in ("first", "third"))
    folder = first.parent
    parts = [
        images.file_system(folder / "1.img", "vfat", first),
        images.file_system(folder / "2.img", "ext4"),
        images.file_system(folder / "3.img", "exfat", third),
        None,
    ]
    count = len(_told(machine))
    disk = machine.plug(images.partitioned(folder / "disk.img", "dos", parts))
    rows = sorted(_until(machine, count + 4)[count:], key=lambda row: row["drive"])
    assert [row.get("files") for row in rows] == [_contents(first), {}, _contents(third), None]
    assert rows[3]["codes"] == ["FS_UNSUPPORTED"], rows
    machine.pull(disk)
    _until(machine, count + 8)


def _see_told(machine: Machine, image: Path, code: str) -> None:
    count = len(_told(machine))
    stick = machine.plug(image)
    (row,) = _until(machine, count + 1)[count:]
    assert row["codes"] == [code], row
    machine.pull(stick)
    _until(machine, count + 2)


def _see_swapped(lab: Lab, machine: Machine) -> str:
    """Another stick at the same port at once: told as another drive, and read as what it is."""
    images_of = {name: lab.stick(name, doer(name, "pass")) for name in ("one", "other")}
    count = len(_told(machine))
    stick = machine.plug(images_of["one"], port="3")
    _until(machine, count + 1)
    machine.pull(stick)
    stick = machine.plug(images_of["other"], port="3")
    one, gone, other = _until(machine, count + 3)[count:]
    assert gone == {**gone, "event": "DriveRemoved", "drive": one["drive"]}, gone
    assert list(other["files"]) == ["org.example.other"], other
    assert other["drive"] != one["drive"]
    machine.pull(stick)
    _until(machine, count + 4)
    return f"{one['drive']}, then {other['drive']} at the same port"


def _contents(content: Path) -> dict[str, int]:
    """Payload → size of its contents list."""
    lists = content.glob("nondum/*/CONTENTS")
    return {file.parent.name: file.stat().st_size for file in lists}


def _told(machine: Machine) -> list[dict[str, Any]]:
    lines = machine.attempt("cat /run/told").out.split("\n")[:-1]
    return [json.loads(line) for line in lines]


def _until(machine: Machine, count: int) -> list[dict[str, Any]]:
    """What was told, once so much was. Raises `AssertionError` with what was told instead."""

    def look() -> list[dict[str, Any]] | None:
        told = _told(machine)
        return told if len(told) >= count else None

    try:
        return machine.until(f"{count} events", look, every_s=1.0)
    except AssertionError as error:
        raise AssertionError(f"{error}\n{_told(machine)}") from error


def _is_there(machine: Machine, label: str) -> bool | None:
    seen = machine.attempt(f"udevadm settle && test -e /dev/disk/by-label/{label}")
    return True if seen.status == 0 else None
