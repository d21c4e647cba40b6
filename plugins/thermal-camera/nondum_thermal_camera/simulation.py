"""The simulated thermal image: a stated model that turns a colour recording into warmth.

The model, and all that it claims:
1. What differs from the median of the whole recording is a warm body: the largest difference of
   the three colours, from `SHADOW` (a cast shadow is not warm) up to `CERTAIN`. So a person who
   stands still for most of the recording counts as background.
2. The background is at ambient temperature; a tenth of its brightness shows through, as
   emissivity differs between materials.
3. Bodies are warmer than that by up to `BODY` grey levels; clothing hides part of it, and the
   brightness of the recording stands for how much (`CLOTHING`).
4. The optics blur by `BLUR_PX`, and the sensor adds Gaussian noise of `NOISE` grey levels, its own
   for each frame.
Grey levels are white-hot, 8 bits; they are not degrees.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from nondum_panorama.clip import Clip
from nondum_panorama.recording import Frame, Recording, Tell, frames_of, not_told
from nondum_panorama.streaming import open_recording

AMBIENT = 60.0
BODY = 130.0
CLOTHING = 0.35
SHADOW = 12.0
CERTAIN = 50.0
BLUR_PX = 0.8
NOISE = 2.0
BACKGROUND_EVERY = 10
"""The background is the median of every tenth frame."""
KEPT_FRAMES = 64


class ThermalModel:
    """Knows the background of one recording."""

    def __init__(self, background: Frame) -> None:
        self._background = background
        self._ambient = AMBIENT + 0.1 * (_grey(background) - 128.0)

    @classmethod
    def of(cls, frames: Iterable[Frame]) -> ThermalModel:
        """Take the background from frames that are spread over a recording."""
        stacked = np.stack(list(frames))
        return cls(np.median(stacked, axis=0, overwrite_input=True).astype(np.uint8))

    def warmth(self, frame: Frame, seed: int) -> Frame:
        """The simulated thermal image of a colour frame; the same seed gives the same noise."""
        difference = np.asarray(cv2.absdiff(frame, self._background)).max(axis=2)
        soft = _blurred(difference.astype(np.float32), BLUR_PX)
        warm = np.clip((soft - SHADOW) / (CERTAIN - SHADOW), 0.0, 1.0)
        shown = 1.0 - CLOTHING * _grey(frame) / 128.0
        image = _blurred(self._ambient + warm * BODY * shown, BLUR_PX)
        image += np.random.default_rng(seed).normal(0.0, NOISE, image.shape).astype(np.float32)
        return np.clip(image, 0, 255).astype(np.uint8)


def _grey(frame: Frame) -> npt.NDArray[np.float32]:
    return np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.float32)


def _blurred(image: Any, sigma_px: float) -> npt.NDArray[np.float32]:
    return np.asarray(cv2.GaussianBlur(image, (0, 0), sigma_px), dtype=np.float32)


class Simulation:
    """The thermal images of a recording, made when they are first asked for, the newest kept."""

    def __init__(self, recording: Recording, model: ThermalModel) -> None:
        self._recording = recording
        self._model = model
        self._kept = functools.lru_cache(KEPT_FRAMES)(self._made)

    def frame(self, number: int) -> Frame:
        """The thermal image of the full frame of that number, height × width. Raises `KeyError`."""
        return self._kept(number)

    def _made(self, number: int) -> Frame:
        return self._model.warmth(self._recording.frame(number), seed=number)


def open_simulation(clip: Clip, tell: Tell = not_told) -> Simulation:
    """Read a clip and learn its background. Fails with RECORDING_UNREADABLE."""
    recording = open_recording(clip, lambda done: tell(done / 2))
    spread = []
    for number, frame in enumerate(frames_of(clip.video)):
        if number % BACKGROUND_EVERY == 0:
            spread.append(frame)
        tell(1 - 0.5 / (1 + number / BACKGROUND_EVERY))  # how many there are is not known before
    return Simulation(recording, ThermalModel.of(spread))
