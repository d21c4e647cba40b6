"""The kernel's messages about devices that were removed (netlink(7), NETLINK_KOBJECT_UEVENT)."""

from __future__ import annotations

import socket

UEVENT_BYTES = 8192
"""The kernel's are at most 2 KiB and a path long."""
_KOBJECT_UEVENT = 15
_KERNEL_GROUP = 1


def listen() -> socket.socket:
    """A socket that gets each message from now on. Raises `OSError`."""
    listening = socket.socket(socket.AF_NETLINK, socket.SOCK_DGRAM, _KOBJECT_UEVENT)
    listening.bind((0, _KERNEL_GROUP))
    return listening


def removed(message: bytes) -> tuple[int, int] | None:
    """The number of the character device whose removal a message tells of, if it does.

    >>> removed(b"remove@/d/hidraw0\\0ACTION=remove\\0SUBSYSTEM=hidraw\\0MAJOR=240\\0MINOR=3\\0")
    (240, 3)
    >>> removed(b"remove@/d/sda\\0ACTION=remove\\0SUBSYSTEM=block\\0MAJOR=8\\0MINOR=0\\0")
    """
    told = dict(part.split(b"=", 1) for part in message.split(b"\0") if b"=" in part)
    if told.get(b"ACTION") != b"remove" or told.get(b"SUBSYSTEM") == b"block":
        return None
    major, minor = told.get(b"MAJOR", b""), told.get(b"MINOR", b"")
    return (int(major), int(minor)) if major.isdigit() and minor.isdigit() else None
