"""A Compton camera on a pseudo-terminal that sends what a test puts on its line."""

from __future__ import annotations

import binascii
import os
import pty
import struct
import threading
import tty
from collections.abc import Iterator

import numpy as np

from nondum_compton_camera.listmode import Event, Interaction

LINE_KEV = 661.657


def frame(kind: int, payload: bytes) -> bytes:
    """A frame as docs/compton-listmode.md has it."""
    body = bytes((kind, len(payload))) + payload
    return b"\xeb\x90" + body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))


def encoded(event: Event) -> bytes:
    """The frame of an event."""
    hits = [
        number
        for hit in (event.first, event.second)
        for number in (*(round(x * 100) for x in hit.position_mm), round(hit.energy_kev * 10))
    ]
    return frame(1, struct.pack("<IQhhhHhhhH", event.sequence, event.time_ns, *hits))


def events(source: tuple[float, float, float], seed: int = 0) -> Iterator[Event]:
    """Endless events of a far source: one scattering, then absorption, blurred a little."""
    dice = np.random.default_rng(seed)
    flight = -np.array(source)
    sequence = 0
    while True:
        theta = dice.uniform(0.3, 1.6)
        scattered = LINE_KEV / (1 + LINE_KEV / 510.99895 * (1 - np.cos(theta)))
        aside = np.cross(flight, dice.normal(size=3))
        onward = np.cos(theta) * flight + np.sin(theta) * aside / np.linalg.norm(aside)
        first = dice.uniform(-15, 15, 3)
        second = first + 25 * onward + dice.normal(size=3) * 0.5
        hits = [
            Interaction((float(x), float(y), float(z)), float(energy + dice.normal() * 2))
            for (x, y, z), energy in ((first, LINE_KEV - scattered), (second, scattered))
        ]
        yield Event(sequence, sequence * 1000, hits[sequence % 2], hits[1 - sequence % 2])
        sequence += 1


class Camera:
    """A port, and a thread that keeps its line full."""

    def __init__(self) -> None:
        self._ours, self._theirs = pty.openpty()
        tty.setraw(self._theirs)
        self.node = os.ttyname(self._theirs)
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._is_open = True

    def send(self, pieces: Iterator[bytes], *, every_s: float = 0.002) -> None:
        """Keep sending until there is nothing more, or the camera is switched off."""

        def work() -> None:
            for piece in pieces:
                if self._stop.wait(every_s):
                    return
                os.write(self._ours, piece)

        self._thread = threading.Thread(target=work)
        self._thread.start()

    def switch_off(self) -> None:
        self._stop.set()
        # A writer that found the line full waits until somebody empties it.
        os.set_blocking(self._theirs, False)
        while self._thread is not None and self._thread.is_alive():
            self._drain()
            self._thread.join(0.01)

    def unplug(self) -> None:
        self.switch_off()
        os.close(self._ours)
        self._is_open = False

    def close(self) -> None:
        if self._is_open:
            self.unplug()
        os.close(self._theirs)

    def _drain(self) -> None:
        try:
            os.read(self._theirs, 65536)
        except BlockingIOError:
            return
