"""Drives that are laid out oddly, and what people and their machines leave on them."""

from __future__ import annotations

from collections.abc import Callable

from tests.faults.hostile.case import NO_PAYLOAD, Bench, HostileDrive, tampered

MANY = "TOO_MANY_FILES"

LITTER = (
    ".DS_Store",
    "._nondum",
    ".Spotlight-V100/Store-V2/x/tmp.spotlight.state",
    ".Trashes/501/old",
    ".fseventsd/fseventsd-uuid",
    ".TemporaryItems/x",
    "System Volume Information/IndexerVolumeGuid",
    "System Volume Information/WPSettings.dat",
    "$RECYCLE.BIN/S-1-5-21/desktop.ini",
    "Thumbs.db",
    "desktop.ini",
    "lost+found/#12",
    "nondum/.DS_Store",
    "nondum/._org.example.lamp",
    "nondum/desktop.ini",
    "nondum/thumbs.db",
)
"""What systems leave on sticks."""

BAIT = (
    "autorun.inf",
    "autorun.sh",
    ".autorun",
    "autoopen",
    "sitecustomize.py",
    "usercustomize.py",
    "conftest.py",
    "setup.py",
    "pyproject.toml",
    "pip.conf",
    "pyvenv.cfg",
    ".bashrc",
    ".profile",
    ".xinitrc",
    ".config/autostart/evil.desktop",
    "etc/udev/rules.d/99-evil.rules",
    "etc/nondum/host.toml",
    "nondum/host.toml",
    "nondum/__init__.py",
    "nondum/nondum.py",
    "nondum/evil.pth",
)
"""What somebody might run, beside payloads; in each payload folder, too."""


def bare(name: str, code: str, make: Callable[[Bench], None]) -> HostileDrive:
    return HostileDrive(name, code, make)


def litter(bench: Bench) -> None:
    for path in LITTER:
        place(bench, path, b"litter")


def bait(bench: Bench) -> None:
    for path in BAIT:
        place(bench, path, bench.python())
        place(bench, f"nondum/{bench.payload_id}/{path}", bench.shell())


def place(bench: Bench, path: str, data: bytes) -> None:
    file = bench.drive / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(data)
    file.chmod(0o777)


def payloads_without_number(bench: Bench) -> None:
    for number in range(65):
        (bench.drive / f"nondum/org.example.p{number}").mkdir(parents=True)


def names_without_number(bench: Bench) -> None:
    folder = bench.drive / "nondum"
    folder.mkdir(parents=True)
    for number in range(5000):
        (folder / f"{number}").touch()


def deep(bench: Bench) -> None:
    """Three hundred folders, one in the other."""
    import os

    here = os.open(bench.drive, os.O_DIRECTORY)
    for _ in range(300):
        os.mkdir("nondum", dir_fd=here)
        inner = os.open("nondum", os.O_DIRECTORY, dir_fd=here)
        os.close(here)
        here = inner
    os.close(here)


def sound_beside(tamper: Callable[[Bench], None]) -> Callable[[Bench], None]:
    """Beside a payload that works."""

    def make(bench: Bench) -> None:
        bench.sound()
        tamper(bench)

    return make


def only(path: str) -> Callable[[Bench], None]:
    return lambda bench: (bench.drive / path).mkdir(parents=True)


def moved(to: str) -> Callable[[Bench], None]:
    """The payload lies where the host does not look."""

    def tamper(bench: Bench) -> None:
        target = bench.drive / to
        target.parent.mkdir(parents=True, exist_ok=True)
        bench.folder.rename(target)

    return tamper


def a_file(bench: Bench) -> None:
    (bench.drive / "nondum").touch()


DRIVES: tuple[HostileDrive, ...] = (
    bare("nothing-on-it", NO_PAYLOAD, lambda bench: None),
    bare("holiday-pictures", NO_PAYLOAD, only("DCIM/100CANON")),
    bare("empty-nondum", NO_PAYLOAD, only("nondum")),
    bare("nondum-a-file", NO_PAYLOAD, a_file),
    bare("nondum-in-capitals", NO_PAYLOAD, only("NONDUM/org.example.lamp")),
    bare("names-without-dots", NO_PAYLOAD, only("nondum/lamp")),
    bare("names-in-capitals", NO_PAYLOAD, only("nondum/Org.Example.Lamp")),
    bare("only-hidden", NO_PAYLOAD, only("nondum/.org.example.lamp")),
    bare("name-not-utf-8", NO_PAYLOAD, only("nondum/org.example.\udcff")),
    bare("folders-without-end", NO_PAYLOAD, deep),
    bare("litter-only", NO_PAYLOAD, litter),
    bare("payloads-without-number", MANY, payloads_without_number),
    bare("names-without-number", MANY, names_without_number),
    tampered("payload-too-deep", NO_PAYLOAD, moved("nondum/more/org.example.lamp")),
    tampered("payload-beside", NO_PAYLOAD, moved("payloads/org.example.lamp")),
    bare("litter-beside", "", sound_beside(litter)),
    bare("bait-beside", "", sound_beside(bait)),
)
