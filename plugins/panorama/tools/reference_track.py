# ruff: noqa: INP001 - a script, not part of a package
"""Make the reference track: the column of one person in the full frame, frame by frame.

    python tools/reference_track.py nondum_panorama/data/pedestrians.csv

Columns were read off enlarged frames by eye (`SEEDS`); between them a full-frame detection within
`NEAR_PX` of the line between two seeds moves it, and a moving average smooths the gait away.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import cv2
import numpy as np

from nondum_panorama.clip import packaged_clip
from nondum_panorama.recording import frames_of

SEEDS = {
    16: 741, 19: 718, 22: 698, 26: 676, 31: 641, 36: 615, 41: 584, 46: 552, 51: 521, 56: 497,
    60: 486, 64: 473,
}  # fmt: skip
"""Frame → column of the middle of the walker in the red and blue jacket."""
NEAR_PX = 10.0
MARGIN = 3


def main(out: Path) -> None:
    """Write the track of the packaged clip's stretch to `out`."""
    clip = packaged_clip()
    numbers = np.arange(clip.first - MARGIN, clip.last + MARGIN + 1)
    by_eye = np.interp(numbers, list(SEEDS), list(SEEDS.values()))
    hog = cv2.HOGDescriptor()
    hog.setSVMDetector(np.asarray(cv2.HOGDescriptor.getDefaultPeopleDetector()))
    columns = by_eye.copy()
    for number, frame in enumerate(frames_of(clip.video, stop=int(numbers[-1]) + 1)):
        if number >= numbers[0]:
            place = number - numbers[0]
            columns[place] = _refined(hog, frame, float(by_eye[place]))
    smooth = np.convolve(columns, np.ones(2 * MARGIN + 1) / (2 * MARGIN + 1), mode="valid")
    with out.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["frame", "column"])
        rows.writerows(
            [n, f"{c:.1f}"] for n, c in zip(numbers[MARGIN:-MARGIN], smooth, strict=True)
        )


def _refined(hog: cv2.HOGDescriptor, frame: np.ndarray, seed: float) -> float:
    boxes, _ = hog.detectMultiScale(frame, hitThreshold=0.3, winStride=(4, 4), scale=1.03)
    middles = [x + width / 2 for x, _, width, height in boxes if height < frame.shape[0] / 3]
    near = min(middles, key=lambda middle: abs(middle - seed), default=seed)
    return (seed + near) / 2 if abs(near - seed) < NEAR_PX else seed


if __name__ == "__main__":
    main(Path(sys.argv[1]))
