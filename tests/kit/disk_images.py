"""Drives as images of a file system, for loop devices."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pyudev
from tests.kit import loop_devices
from tests.kit.payloads import Part, make_payload

from nondum.host.sources.drives.blocks import Accepts

LAMP_ID = "org.example.lamp"


def image(
    tmp_path: Path,
    *parts: Part,
    size_mb: int = 24,
    payload_id: str = LAMP_ID,
    spoilt: bool = False,
) -> Path:
    """An ext4 image of a drive with one payload; `spoilt`: a file changed since it was listed."""
    folder = make_payload(tmp_path / "content", *parts, payload_id=payload_id)
    if spoilt:
        with (folder / "index.json").open("ab") as index:
            index.write(b" ")
    file = tmp_path / "drive.img"
    make_ext4(tmp_path / "content", file, size_mb)
    return file


def make_ext4(content: Path, file: Path, size_mb: int = 24) -> None:
    """A file system of a folder's files."""
    with file.open("wb") as out:
        out.truncate(size_mb * 1024**2)
    run("mkfs.ext4", "-q", "-d", str(content), str(file))


def cut_off(file: Path) -> None:
    """Most of an image is gone."""
    loop_devices.cut_off(file, 6 * 1024**2)


def on(tmp_path: Path) -> Accepts:
    """Loop devices on this test's images, and no other block device of the machine."""

    def accepts(device: pyudev.Device) -> bool:
        disk = Path(device.sys_path)
        backing = (disk.parent if device.device_type == "partition" else disk) / "loop/backing_file"
        return backing.exists() and backing.read_text().startswith(f"{tmp_path}/")

    return accepts


def attribute(node: Path, name: str) -> int:
    """What sysfs says of a block device."""
    return int(Path(f"/sys/block/{node.name}/{name}").read_text())


def run(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout
