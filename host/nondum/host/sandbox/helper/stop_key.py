"""One key of an input device: its reader sees no other key (EVIOCSMASK) and does not grab it.

Source: Linux, Documentation/input/input.rst and include/uapi/linux/input.h.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
import stat
import struct
from pathlib import Path

from nondum.host.config.stop_keys import MOST
from nondum.sdk.errors import InstallFailed, Problem

EVENT = struct.Struct("@llHHi")
"""struct input_event: time in s and µs, type, code, value."""
EV_KEY, PRESSED = 0x01, 1
_OTHER_TYPES = (0x02, 0x03, 0x04, 0x05, 0x11, 0x12)
"""EV_REL, EV_ABS, EV_MSC (which tells of every key that is pressed), EV_SW, EV_LED, EV_SND."""
_MASK = struct.Struct("@IIQ")
_EVIOCSMASK = 0x40104593
"""_IOW('E', 0x93, struct input_mask)"""
_BYTES = MOST // 8 + 1
_EVIOCGKEY = 2 << 30 | _BYTES << 16 | ord("E") << 8 | 0x18
"""_IOR('E', 0x18, …): the keys that are down."""
_EVIOCGBIT_KEY = 2 << 30 | _BYTES << 16 | ord("E") << 8 | 0x20 + EV_KEY
"""_IOR('E', 0x20 + EV_KEY, …): the keys that there are."""
_AT_ONCE = 64


class PressesOfDevice:
    """Presses of one key, read from its device; the device is its own to close."""

    def __init__(self, descriptor: int, code: int, *, is_down: bool = False) -> None:
        """`is_down`: it was held down already, which counts as a press."""
        self._descriptor, self._code = descriptor, code
        self.is_down_at_first = is_down

    def fileno(self) -> int:
        """To wait for."""
        return self._descriptor

    def read(self) -> int:
        """How many presses have come. Raises `OSError` when the device is gone."""
        try:
            data = os.read(self._descriptor, _AT_ONCE * EVENT.size)
        except BlockingIOError:
            return 0
        if not data:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        whole = data[: len(data) - len(data) % EVENT.size]
        events = EVENT.iter_unpack(whole)
        return sum(
            (kind, code, value) == (EV_KEY, self._code, PRESSED)
            for _, _, kind, code, value in events
        )

    def close(self) -> None:
        """Let go of the device."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def opened(path: Path, code: int) -> PressesOfDevice:
    """Open an input device for one of its keys. Raises `InstallFailed` (STOP_KEY)."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise unusable(path, error.strerror or str(error)) from error
    try:
        if not stat.S_ISCHR(os.fstat(descriptor).st_mode):
            raise unusable(path, "it is no device")
        if not _bit(descriptor, _EVIOCGBIT_KEY, code):
            raise unusable(path, f"it has no key with the code {code}")
        _mask_all_but(descriptor, code)
        return PressesOfDevice(descriptor, code, is_down=_bit(descriptor, _EVIOCGKEY, code))
    except OSError as error:
        os.close(descriptor)
        raise unusable(path, "it is no input device") from error
    except BaseException:
        os.close(descriptor)
        raise


def unusable(path: Path, why: str) -> InstallFailed:
    """What is told of a key that cannot be listened to."""
    fix = "plug the device in, and see `device` and `key` under [stop]"
    return InstallFailed(
        Problem("STOP_KEY", f"the stop key does not work: {why}", str(path), fix=fix)
    )


def _bit(descriptor: int, request: int, code: int) -> bool:
    bits = bytearray(_BYTES)
    fcntl.ioctl(descriptor, request, bits)
    return bool(bits[code // 8] >> code % 8 & 1)


def _mask_all_but(descriptor: int, code: int) -> None:
    """Have the kernel send this reader no events but those of one key (Linux 4.4)."""
    bits = bytearray(_BYTES)
    bits[code // 8] |= 1 << code % 8
    _mask(descriptor, EV_KEY, bytes(bits))
    for kind in _OTHER_TYPES:
        _mask(descriptor, kind, bytes(_BYTES))


def _mask(descriptor: int, kind: int, bits: bytes) -> None:
    codes = ctypes.create_string_buffer(bits, len(bits))
    fcntl.ioctl(descriptor, _EVIOCSMASK, _MASK.pack(kind, len(bits), ctypes.addressof(codes)))
