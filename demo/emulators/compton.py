"""A Compton camera on a serial line: photons in, list-mode frames out.

The frames: docs/compton-listmode.md.
"""

from __future__ import annotations

import binascii
import math
import struct
from collections.abc import Iterator

import numpy as np

from demo.emulators import detector
from demo.emulators.pose import Floats
from demo.scenario import Scenario

LINE_KEV = 661.657
BRANCHING = 0.851
AIR_PER_M = 0.0093
"""Attenuation of air at the line."""
ROOM_SCATTER = 0.5
"""Photons that reach the block by way of ground and walls, per photon that comes straight."""
NATURAL_HZ = 400.0
"""Interactions by soil, walls and sky."""
BYTES_PER_S = 46_080
"""460800 baud, ten bits a byte."""
FIFO_BYTES = 4096

_EVENT = struct.Struct("<IQhhhHhhhH")
_STATUS = struct.Struct("<III")


class ComptonCamera:
    """The instrument from power-up; `advance` lets time pass and gives the bytes it sends."""

    def __init__(self, scenario: Scenario) -> None:
        self._rng = np.random.default_rng([scenario.seed, 1])
        self._source_mm = scenario.camera.seen(scenario.source_m) * 1000
        self.photons_hz = straight_hz(scenario.activity_bq, float(np.linalg.norm(self._source_mm)))
        self._now_s = 0.0
        self._next_status_s = 1.0
        self._sequence = 0
        self._lost = 0
        self._fifo = bytearray()

    def advance(self, dt_s: float) -> bytes:
        """What leaves the line in the next `dt_s`, which must be short: a twentieth of a second."""
        for frame in self._frames(dt_s):
            self._push(frame)
        self._now_s += dt_s
        if self._now_s >= self._next_status_s:
            self._next_status_s += 1.0
            status = _STATUS.pack(int(self._now_s * 1e3), self._sequence, self._lost)
            self._fifo += _frame(2, status)  # the FIFO keeps space for this one
        most = int(BYTES_PER_S * dt_s)
        sent = bytes(self._fifo[:most])
        del self._fifo[:most]
        return sent

    def _push(self, frame: bytes) -> None:
        if len(self._fifo) + len(frame) > FIFO_BYTES:
            self._lost += 1
        else:
            self._fifo += frame

    def _frames(self, dt_s: float) -> Iterator[bytes]:
        for positions, energies in self._pairs(dt_s):
            at_ns = int((self._now_s + self._rng.uniform(0, dt_s)) * 1e9)
            hits = [
                number
                for position, energy in zip(positions, energies, strict=True)
                for number in (*(round(x * 100) for x in position), round(energy * 10))
            ]
            yield _frame(1, _EVENT.pack(self._sequence, at_ns, *hits))
            self._sequence += 1

    def _pairs(self, dt_s: float) -> list[tuple[list[list[float]], list[float]]]:
        """Positions (mm) and energies (keV) of the pairs of one stretch of time, shuffled."""
        straight = detector.from_point(
            self._rng, self._source_mm, LINE_KEV, int(self._rng.poisson(self.photons_hz * dt_s))
        )
        around = detector.from_around(self._rng, self._background(dt_s))
        positions = np.concatenate((straight.positions_mm, around.positions_mm)).tolist()
        energies = np.concatenate((straight.energies_kev, around.energies_kev)).tolist()
        pairs = list(zip(positions, energies, strict=True))
        return [pairs[int(i)] for i in self._rng.permutation(len(pairs))]

    def _background(self, dt_s: float) -> Floats:
        """Energies: the line's photons after scattering in the room, and a natural continuum."""
        scattered = int(self._rng.poisson(ROOM_SCATTER * self.photons_hz * dt_s))
        natural = int(self._rng.poisson(NATURAL_HZ * dt_s))
        continuum = np.minimum(80 + self._rng.exponential(400, natural), 2614.5)
        return np.concatenate((self._rng.uniform(80, LINE_KEV, scattered), continuum))


def straight_hz(activity_bq: float, distance_mm: float) -> float:
    """Photons a second that come straight from the source and would interact in the block."""
    sphere_mm2 = 4 * math.pi * distance_mm**2
    through_air = math.exp(-AIR_PER_M * distance_mm / 1000)
    flux = activity_bq * BRANCHING * through_air / sphere_mm2
    return flux * detector.interacting_area_mm2(LINE_KEV)


def _frame(kind: int, payload: bytes) -> bytes:
    body = bytes((kind, len(payload))) + payload
    return b"\xeb\x90" + body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))
