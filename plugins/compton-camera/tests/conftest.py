"""Frames and skies for tests, made here so that the plugin is judged against something else."""

from __future__ import annotations

import binascii
import struct
from collections.abc import Callable

import numpy as np
import pytest

from nondum_compton_camera.kinematics import Cones
from nondum_compton_camera.listmode import Event

MakeFrame = Callable[[int, bytes], bytes]
EncodeEvent = Callable[[Event], bytes]
MakeSky = Callable[..., Cones]


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture(scope="session")
def frame() -> MakeFrame:
    """Makes a frame of a type and payload, as docs/compton-listmode.md has it."""

    def make(kind: int, payload: bytes) -> bytes:
        body = bytes((kind, len(payload))) + payload
        return b"\xeb\x90" + body + struct.pack("<H", binascii.crc_hqx(body, 0xFFFF))

    return make


@pytest.fixture(scope="session")
def encoded(frame: MakeFrame) -> EncodeEvent:
    """Makes the frame of an event."""

    def make(event: Event) -> bytes:
        hits = [
            number
            for hit in (event.first, event.second)
            for number in (*(round(x * 100) for x in hit.position_mm), round(hit.energy_kev * 10))
        ]
        return frame(1, struct.pack("<IQhhhHhhhH", event.sequence, event.time_ns, *hits))

    return make


@pytest.fixture(scope="session")
def sky() -> MakeSky:
    """Makes cones of a source, exactly as thick as they say, and cones of an even background."""

    def make(
        rng: np.random.Generator, source: np.ndarray, *, cones: int, background: int = 0
    ) -> Cones:
        total = cones + background
        axes = rng.normal(size=(total, 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        sigmas = rng.uniform(0.05, 0.12, total)
        angles = np.arccos(axes @ source) + rng.normal(size=total) * sigmas
        angles[cones:] = np.arccos(rng.uniform(-0.8, 0.9, background))
        kept = (angles > 0.15) & (angles < 2.7)
        both = np.stack((axes, -axes), axis=1)
        weights = np.tile((1.0, 0.0), (total, 1))
        return Cones(
            both[kept],
            np.stack((angles, angles), axis=1)[kept],
            np.stack((sigmas, sigmas), axis=1)[kept],
            weights[kept],
        )

    return make
