"""What is no plain file in a plain folder."""

from __future__ import annotations

import os
import socket
import stat
from collections.abc import Callable
from pathlib import Path

from tests.faults.hostile.case import NO_PAYLOAD, Bench, HostileDrive, tampered

UNSAFE, MISSING = "PATH_UNSAFE", "FILE_MISSING"

Put = Callable[[Path], None]
"""Puts something where a file was."""


def instead(name: str, path: str, put: Put, code: str = UNSAFE) -> HostileDrive:
    """Something else in the place of a file; `WHEEL` is the payload's wheel."""

    def tamper(bench: Bench) -> None:
        found = next((bench.folder / "wheels").iterdir()) if path == WHEEL else bench.folder / path
        found.unlink(missing_ok=True)
        put(found)

    return tampered(name, code, tamper)


WHEEL = "wheels/*.whl"


def link_to(target: str) -> Put:
    return lambda path: path.symlink_to(target)


def link_to_the_same(path: Path) -> None:
    """The very bytes that are listed, by way of a link."""
    twin = path.with_name("twin")
    twin.write_bytes(b"twin")
    path.symlink_to(twin.name)


def device(major: int, minor: int, kind: int = stat.S_IFCHR) -> Put:
    return lambda path: os.mknod(path, kind | 0o666, os.makedev(major, minor))


def bound_socket(path: Path) -> None:
    """Bound by a short name: the whole one may be too long for a socket's."""
    here = Path.cwd()
    os.chdir(path.parent)
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


def nothing(path: Path) -> None: ...


def filled(path: Path) -> None:
    path.mkdir()
    (path / "inner").touch()


def linked_folder(bench: Bench) -> None:
    """The folder of the wheels is a link to one beside it."""
    wheels = bench.folder / "wheels"
    wheels.rename(bench.folder / "real")
    wheels.symlink_to("real")


def linked_payload(bench: Bench) -> None:
    bench.folder.rename(bench.drive / "elsewhere")
    bench.folder.symlink_to("../elsewhere")


def linked_root(bench: Bench) -> None:
    (bench.drive / "nondum").rename(bench.drive / "real")
    (bench.drive / "nondum").symlink_to("real")


def to_the_machine(bench: Bench) -> None:
    """The folder of payloads is the machine's own."""
    linked_root(bench)
    (bench.drive / "nondum").unlink()
    (bench.drive / "nondum").symlink_to("/")


DRIVES: tuple[HostileDrive, ...] = (
    instead("list-a-link", "CONTENTS", link_to("/etc/passwd")),
    instead("list-a-pipe", "CONTENTS", os.mkfifo),
    instead("list-a-folder", "CONTENTS", filled),
    instead("list-endless-device", "CONTENTS", device(1, 5)),
    instead("list-a-socket", "CONTENTS", bound_socket),
    instead("signature-a-link", "CONTENTS.sig", link_to("/etc/shadow")),
    instead("signature-a-pipe", "CONTENTS.sig", os.mkfifo),
    instead("signature-a-folder", "CONTENTS.sig", filled),
    instead("manifest-a-link-outside", "payload.toml", link_to("/etc/hostname")),
    instead("manifest-a-link-upwards", "payload.toml", link_to("../../../payload.toml")),
    instead("manifest-a-link-to-itself", "payload.toml", link_to("payload.toml")),
    instead("manifest-a-link-to-a-process", "payload.toml", link_to("/proc/self/environ")),
    instead("manifest-a-link-inside", "payload.toml", link_to_the_same),
    instead("manifest-a-pipe", "payload.toml", os.mkfifo),
    instead("manifest-a-socket", "payload.toml", bound_socket),
    instead("manifest-a-folder", "payload.toml", filled),
    instead("manifest-zeros-without-end", "payload.toml", device(1, 5)),
    instead("manifest-the-memory", "payload.toml", device(1, 1)),
    instead("manifest-a-terminal", "payload.toml", device(5, 0)),
    instead("index-a-disk", "index.json", device(7, 0, stat.S_IFBLK)),
    instead("wheel-a-link", WHEEL, link_to("/usr/bin/python3")),
    instead("wheel-a-pipe", WHEEL, os.mkfifo),
    instead("wheel-a-device", WHEEL, device(1, 9)),
    instead("wheel-a-folder", WHEEL, filled),
    instead("no-manifest", "payload.toml", nothing, MISSING),
    instead("no-index", "index.json", nothing, MISSING),
    instead("no-wheel", WHEEL, nothing, MISSING),
    tampered("wheels-through-a-link", UNSAFE, linked_folder),
    tampered("payload-is-a-link", NO_PAYLOAD, linked_payload),
    tampered("nondum-is-a-link", NO_PAYLOAD, linked_root),
    tampered("nondum-is-the-machine", NO_PAYLOAD, to_the_machine),
)
