"""vfat, exfat, ext4; whole disks, tables, several partitions; odd labels, litter: all are read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.lab import images
from tests.lab.followed import Followed, Stick
from tests.lab.lab import Lab
from tests.lab.plugins import doer

TABLES = {"vfat": "dos", "exfat": "gpt", "ext4": "gpt"}


def run(lab: Lab) -> str:
    """One drawer of drives after the other is plugged in at once, and pulled."""
    host = Followed.follow(lab.host())
    whole = {f"whole-{kind}": _whole(lab, kind) for kind in images.FILE_SYSTEMS}
    _see_at_work(host, whole)
    tables = {f"table-{kind}": _with_table(lab, kind) for kind in images.FILE_SYSTEMS}
    _see_at_work(host, tables)
    _see_several(host, _several(lab))
    codes = _see_told(lab, host)
    return f"{len(whole) + len(tables)} drives, one of several partitions; told: {codes}"


def _see_at_work(host: Followed, drives: dict[str, Path]) -> None:
    """Plug drives in, wait for their payloads, and have all gone again."""
    plugged = host.bring_all({f"org.example.{name}": Stick(drives[name]) for name in drives})
    _have_gone(host, *plugged.values())


def _have_gone(host: Followed, *plugged: str) -> None:
    for name in plugged:
        host.machine.pull(name)
    host.until("nothing is left", lambda v: None if v["drives"] or v["payloads"] else True)


def _content(lab: Lab, name: str) -> Path:
    return images.with_litter(lab.payload(name, doer(name, "pass")))


def _whole(lab: Lab, kind: str) -> Path:
    """A disk without a partition table."""
    content = _content(lab, f"whole-{kind}")
    return images.file_system(
        content.parent / "disk.img", kind, content, label=images.ODD_LABELS[kind]
    )


def _with_table(lab: Lab, kind: str) -> Path:
    content = _content(lab, f"table-{kind}")
    part = images.file_system(content.parent / "part.img", kind, content, label="STICK")
    return images.partitioned(content.parent / "disk.img", TABLES[kind], [part])


def _several(lab: Lab) -> Path:
    """Payloads on the first and the third; the second has only photographs, the fourth nothing."""
    first, third = _content(lab, "first"), _content(lab, "third")
    photos = first.parent / "photos"
    (photos / "DCIM").mkdir(parents=True)
    (photos / "DCIM/beach.jpg").write_bytes(b"sand")
    parts = [
        images.file_system(first.parent / "1.img", "vfat", first),
        images.file_system(first.parent / "2.img", "ext4", photos),
        images.file_system(third.parent / "3.img", "exfat", third),
        None,
    ]
    return images.partitioned(first.parent / "disk.img", "gpt", parts)


def _see_several(host: Followed, image: Path) -> None:
    """Both payloads of one drive are at work, and go with it."""
    disk = host.bring(image, "org.example.first")
    host.until_payload("org.example.third", "active")
    told = host.until("four are told", lambda v: v["drives"] if len(v["drives"]) == 4 else None)
    codes = sorted(problem.split()[0] for drive in told for problem in drive["problems"])
    assert codes == ["DRIVE_NOT_PAYLOAD", "FS_UNSUPPORTED"], told
    _have_gone(host, disk)


def _see_told(lab: Lab, host: Followed) -> str:
    """What of drives that cannot be used is said, drive by drive."""
    folder = lab.folder()
    wrong = {
        "FS_UNSUPPORTED": images.blank(folder / "blank.img"),
        "FS_UNSUPPORTED swap": images.file_system(folder / "swap.img", "swap"),
        "DRIVE_NOT_PAYLOAD": images.file_system(folder / "empty.img", "vfat"),
    }
    said = []
    for words, image in wrong.items():
        name = host.machine.plug(image)
        (told,) = host.until(words, _problems)
        assert all(word in told for word in words.split()), f"{words}: {told}"
        said.append(told.split()[0])
        _have_gone(host, name)
    return ", ".join(said)


def _problems(view: dict[str, Any]) -> list[str] | None:
    return [problem for drive in view["drives"] for problem in drive["problems"]] or None
