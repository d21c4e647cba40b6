"""A simulated GPS receiver: a pseudo-terminal that sends bytes, and nothing else.

It is for tests only. What it claims to be reaches the plugin as sentences on the line; their sums
are worked out here, by the standard, not by the library that reads them.
"""

from __future__ import annotations

import contextlib
import os
import pty
import threading
import tty
from functools import reduce

_EVERY_S = 0.02


def sentence(body: str) -> bytes:
    """A sentence as NMEA 0183 has it: `GPGGA,…` → `$GPGGA,…*47` and the end of a line."""
    total = reduce(lambda one, other: one ^ other, body.encode("ascii"), 0)
    return f"${body}*{total:02X}\r\n".encode("ascii")


def gga(
    latitude_deg: float = 51.05,
    longitude_deg: float = 13.74,
    *,
    talker: str = "GN",
    quality: int = 1,
    satellites: int = 8,
    hdop: str = "0.9",
    sea_level: str = "118.2",
    geoid: str = "44.6",
) -> bytes:
    """A fix of the given quality; without one, the fields of the place are empty."""
    place = angle(latitude_deg, 2, "NS") + "," + angle(longitude_deg, 3, "EW") if quality else ",,,"
    rest = f"{quality},{satellites:02d},{hdop},{sea_level},M,{geoid},M,,"
    return sentence(f"{talker}GGA,101530.00,{place},{rest}")


def rmc(
    latitude_deg: float = 51.05,
    longitude_deg: float = 13.74,
    *,
    talker: str = "GP",
    status: str = "A",
    mode: str = ",A",
) -> bytes:
    """The least that is recommended; `mode` is empty before NMEA 2.3."""
    place = angle(latitude_deg, 2, "NS") + "," + angle(longitude_deg, 3, "EW")
    return sentence(f"{talker}RMC,101530.00,{status},{place},0.01,,251126,,{mode}")


def gsa(dimensions: int, vdop: str = "1.2") -> bytes:
    """How the satellites that are used stand: no fix (1), in the plane (2), in space (3)."""
    return sentence(f"GNGSA,A,{dimensions},02,05,07,13,15,18,20,29,,,,,1.5,0.9,{vdop},1")


def gst(north: str, east: str, up: str) -> bytes:
    """Standard errors."""
    return sentence(f"GNGST,101530.00,3.2,,,,{north},{east},{up}")


def gsv(talker: str, in_view: int) -> bytes:
    """How many satellites of a kind are above the horizon."""
    return sentence(f"{talker}GSV,1,1,{in_view:02d},02,51,278,42")


NO_FIX = gga(quality=0, satellites=0, hdop="99.99", sea_level="", geoid="")


def angle(degrees: float, digits: int, sides: str) -> str:
    """`5103.0000000,N`: whole degrees, then minutes."""
    minutes = round(abs(degrees) * 60, 7)
    whole, rest = divmod(minutes, 60)
    return f"{int(whole):0{digits}d}{rest:010.7f},{sides[degrees < 0]}"


class SimulatedReceiver:
    """A port, and a thread that sends the same again and again, as receivers do every second."""

    def __init__(self) -> None:
        self._ours, theirs = pty.openpty()
        tty.setraw(theirs)
        os.set_blocking(self._ours, False)
        self.node = os.ttyname(theirs)
        self._theirs = theirs
        self._cycle = b""
        self._unplugged = threading.Event()
        self._thread = threading.Thread(target=self._send)
        self._thread.start()

    def says(self, *pieces: bytes) -> None:
        """What it sends from now on; nothing: it is silent."""
        self._cycle = b"".join(pieces)

    def unplug(self) -> None:
        """Pull it: a program that has the port open finds it gone."""
        if not self._unplugged.is_set():
            self._unplugged.set()
            self._thread.join()
            os.close(self._ours)
            os.close(self._theirs)

    def _send(self) -> None:
        while not self._unplugged.wait(_EVERY_S):
            with contextlib.suppress(BlockingIOError):  # no program reads, and the buffer is full
                os.write(self._ours, self._cycle)
