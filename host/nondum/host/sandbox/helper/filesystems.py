"""Which file system a block device has, by its magic numbers, where udev does not say.

Offsets: ext4 (kernel.org, Documentation/filesystems/ext4/super.rst), FAT and exFAT (Microsoft).
"""

from __future__ import annotations

from pathlib import Path

_HEAD = 4096


def probe(node: Path) -> str:
    """Name of the file system as mount(2) wants it; empty: none that drives may have."""
    with node.open("rb", buffering=0) as device:
        return recognise(device.read(_HEAD))


def recognise(head: bytes) -> str:
    """Name of the file system that begins with these bytes.

    >>> recognise(bytes(3) + b"EXFAT   " + bytes(4000))
    'exfat'
    """
    if head[3:11] == b"EXFAT   ":
        return "exfat"
    if head[1080:1082] == b"\x53\xef":
        return "ext4"  # the ext4 driver mounts ext2 and ext3 too
    if head[510:512] == b"\x55\xaa" and (head[54:59] in _FAT or head[82:87] in _FAT):
        return "vfat"
    return ""


_FAT = (b"FAT12", b"FAT16", b"FAT32")
