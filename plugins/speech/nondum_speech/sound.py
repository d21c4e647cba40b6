"""Sound as the recogniser takes it: one channel, 16 kHz, 16 bits; and WAV files of any kind."""

from __future__ import annotations

import io
import wave
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import soxr

RATE_HZ = 16_000
LONGEST_S = 60.0
"""A longer file is no sentence for a robot."""

Samples = npt.NDArray[np.int16]


class SoundInvalid(ValueError):
    """No sound that can be heard; the message says why."""


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """Some sound in one channel at `RATE_HZ`."""

    samples: Samples

    @property
    def seconds(self) -> float:
        """How long it is."""
        return len(self.samples) / RATE_HZ

    def to_bytes(self) -> bytes:
        """The samples, little-endian."""
        return self.samples.astype("<i2").tobytes()

    def to_wav(self) -> bytes:
        """A WAV file of it."""
        file = io.BytesIO()
        with wave.open(file, "wb") as wav:
            wav.setnchannels(1)
            wav.setsampwidth(2)
            wav.setframerate(RATE_HZ)
            wav.writeframes(self.to_bytes())
        return file.getvalue()


def from_bytes(data: bytes) -> Sound:
    """Sound of little-endian samples at `RATE_HZ`."""
    return Sound(np.frombuffer(data, "<i2").astype(np.int16))


def resampled(samples: npt.NDArray[np.int16] | npt.NDArray[np.float32], rate_hz: int) -> Sound:
    """Sound of samples at another rate."""
    if rate_hz != RATE_HZ:
        samples = soxr.resample(samples, rate_hz, RATE_HZ)
    return Sound(np.clip(np.rint(samples), -32768, 32767).astype(np.int16))


def read_wav(path: Path) -> Sound:
    """Read a WAV file of PCM samples; channels are averaged, other rates resampled.

    Raises `SoundInvalid`.
    """
    try:
        with path.open("rb") as file, wave.open(file) as wav:
            channels, width, rate_hz = wav.getnchannels(), wav.getsampwidth(), wav.getframerate()
            promised = wav.getnframes()
            if promised > LONGEST_S * rate_hz:
                raise SoundInvalid(f"it is longer than {LONGEST_S:g} s")
            data = wav.readframes(promised)
    except (OSError, wave.Error, EOFError) as error:
        raise SoundInvalid(f"it is no WAV file of PCM samples: {error}") from error
    if len(data) < promised * channels * width:
        raise SoundInvalid("it ends too early")
    if not promised or not 8000 <= rate_hz <= 192_000:
        raise SoundInvalid(f"{promised} samples at {rate_hz} Hz are no speech")
    return resampled(_decoded(data, width).reshape(-1, channels).mean(axis=1), rate_hz)


def _decoded(data: bytes, width: int) -> npt.NDArray[np.float32]:
    """Samples of 1 to 4 bytes, as 16-bit ones would be."""
    raw = np.frombuffer(data, np.uint8)
    if width == 1:  # the only unsigned ones
        return (raw.astype(np.float32) - 128) * 256
    top = np.ascontiguousarray(raw.reshape(-1, width)[:, -2:])
    return top.view("<i2").reshape(-1).astype(np.float32)
