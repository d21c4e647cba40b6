"""The thermal model: what it claims."""

from __future__ import annotations

import numpy as np

from nondum_panorama.clip import packaged_clip
from nondum_thermal_camera.simulation import AMBIENT, ThermalModel, open_simulation


def scene(level: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    return np.full((60, 80, 3), level, dtype=np.uint8)


def test_what_differs_from_the_background_is_warm() -> None:
    frame = scene(128)
    frame[20:40, 30:50] = 20
    image = ThermalModel(scene(128)).warmth(frame, seed=1)
    assert image[25:35, 35:45].mean() > image[:10].mean() + 80
    assert abs(image[:10].mean() - AMBIENT) < 3


def test_shadow_is_not_warm() -> None:
    frame = scene(128)
    frame[20:40, 30:50] = 118
    image = ThermalModel(scene(128)).warmth(frame, seed=1)
    assert abs(image[25:35, 35:45].mean() - AMBIENT) < 5


def test_background_is_the_median() -> None:
    model = ThermalModel.of([scene(10), scene(128), scene(128), scene(250), scene(128)])
    assert abs(model.warmth(scene(128), seed=1).mean() - AMBIENT) < 3


def test_noise_is_the_seeds_own() -> None:
    model = ThermalModel(scene(128))
    one, same, other = (model.warmth(scene(128), seed=seed) for seed in (1, 1, 2))
    assert (one == same).all()
    assert (one != other).any()


def test_recording_gives_grey_frames() -> None:
    clip = packaged_clip()
    frame = open_simulation(clip).frame(clip.first)
    assert frame.shape == (clip.height, clip.width)
    assert frame.max() > frame.mean() + 60
