"""The score of following: how much of the time the person was straight ahead. Pure.

The truth is a reference track: the column of one person in every full frame of the recording that
the cameras play, and the geometry that the recording is stated to have. Only this reads it.
"""

from __future__ import annotations

import csv
import math
import tomllib
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import remainder, tau
from pathlib import Path

TOLERANCE_RAD = math.radians(10.0)
WANTED_FRACTION = 0.7
WINDOW_S = 10.0

Stamped = tuple[float, float]
"""Seconds on one clock, and a value."""


@dataclass(frozen=True, slots=True)
class Reference:
    """Where the reference person truly is, frame by frame."""

    azimuths: Mapping[int, float]
    """Frame number → radians to the left of straight ahead at the start of the stream."""

    @classmethod
    def read(cls, notes: Path) -> Reference:
        """Read the clip's notes (TOML) and the track (CSV) that they name, beside them."""
        said = tomllib.loads(notes.read_text(encoding="utf-8"))
        rad_per_px = math.radians(said["field_of_view_deg"]) / said["width"]
        with (notes.parent / said["reference"]).open(newline="", encoding="utf-8") as lines:
            columns = {int(row["frame"]): float(row["column"]) for row in csv.DictReader(lines)}
        ahead = said["ahead_column"]
        return cls({number: (ahead - column) * rad_per_px for number, column in columns.items()})


def errors(
    headings: Sequence[Stamped],
    frames: Sequence[tuple[float, int]],
    reference: Reference,
    *,
    start_rad: float | None = None,
) -> tuple[Stamped, ...]:
    """(stamp, radians between heading and person) of every frame that has a reference.

    `headings` are (stamp, yaw) of the body, `frames` (stamp, source frame number) of the images,
    both in order of time, on one clock. The recording hangs where the body looked when the stream
    began: `start_rad`, or, where that is not given, the heading at the first frame, which then must
    be the stream's first. Frames older than the first heading, or newer than the last, do not
    count. Raises `ValueError` when one is empty.
    """
    if not headings or not frames:
        raise ValueError("there is nothing to score: no headings or no frames")
    headings = unwrapped(headings)
    stamps = [stamp for stamp, _ in headings]
    start = _at(headings, stamps, frames[0][0]) if start_rad is None else start_rad
    return tuple(
        (stamp, remainder(_at(headings, stamps, stamp) - start - reference.azimuths[number], tau))
        for stamp, number in frames
        if number in reference.azimuths and stamps[0] <= stamp <= stamps[-1]
    )


def score_following(
    headings: Sequence[Stamped],
    frames: Sequence[tuple[float, int]],
    reference: Reference,
    *,
    window_s: float = WINDOW_S,
    start_rad: float | None = None,
) -> float:
    """The share of frames with the person within ±10° of the heading, over the last `window_s`.

    0.0 when the logs do not reach over a whole window in which the recording moves: images that
    repeat the frame the stream began with are a still picture and count for nothing.
    """
    moving = _moving(frames)
    found = errors(headings, frames, reference, start_rad=start_rad)
    judged = [error for error in found if error[0] >= moving]
    if not judged or judged[-1][0] - judged[0][0] < window_s:
        return 0.0
    last = [error for stamp, error in judged if stamp > judged[-1][0] - window_s]
    return sum(abs(error) <= TOLERANCE_RAD for error in last) / len(last)


def unwrapped(headings: Sequence[Stamped]) -> tuple[Stamped, ...]:
    """The headings without jumps between -π and π.

    >>> [round(yaw, 1) for _, yaw in unwrapped([(0.0, 3.0), (0.1, -3.0)])]
    [3.0, 3.3]
    """
    smooth: list[Stamped] = []
    for stamp, yaw in headings:
        before = smooth[-1][1] if smooth else yaw
        smooth.append((stamp, before + remainder(yaw - before, tau)))
    return tuple(smooth)


def _moving(frames: Sequence[tuple[float, int]]) -> float:
    """When the first frame gave way to the next."""
    first = frames[0][1] if frames else 0
    return next((stamp for stamp, number in frames if number != first), math.inf)


def _at(headings: Sequence[Stamped], stamps: Sequence[float], stamp: float) -> float:
    """The heading at a time, between the two samples around it."""
    after = bisect_left(stamps, stamp)
    if after == 0:
        return headings[0][1]
    if after == len(headings):
        return headings[-1][1]
    (before_s, before), (after_s, value) = headings[after - 1], headings[after]
    return before + (value - before) * (stamp - before_s) / (after_s - before_s)
