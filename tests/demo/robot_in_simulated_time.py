"""Camera, detector, tracker and base wired together without a host, in simulated time.

The parts are the plugins' own; only the clock, the wires and the latency of detection are the
simulation's.
"""

from __future__ import annotations

import functools
import random
from collections.abc import Callable
from dataclasses import dataclass, field

from nondum.sdk import Detections, Header, Image
from nondum_mobile_base.unicycle import Command, Limits, Motion, moved
from nondum_panorama.clip import packaged_clip
from nondum_panorama.playing import Score
from nondum_panorama.recording import Frame
from nondum_panorama.streaming import camera_model, open_recording
from nondum_panorama.view import Lens, View
from nondum_pedestrian_detector.settings import Settings
from nondum_pedestrian_detector.spotter import Spotter
from nondum_people_detector.detection import detect
from nondum_people_detector.hog import HogDetector
from nondum_thermal_camera.simulation import open_simulation
from nondum_visual_tracker.controller import Gains
from nondum_visual_tracker.eye import sightings
from nondum_visual_tracker.follower import Follower

STEP_S = 0.05
HOLD_S = 3.0
CLIP = packaged_clip()

Obedience = Callable[[float], float]
"""The turning rate that the tracker asks for → the one that the base is told."""


@functools.cache
def camera(kind: str) -> Callable[[int], Frame]:
    """Full frames of the colour or the thermal camera."""
    if kind == "colour":
        return open_recording(CLIP).frame
    return open_simulation(CLIP).frame


def detector(name: str) -> Callable[[Image], Detections]:
    """What a detector that goes by that name finds in an image."""
    if name == "pedestrians":
        spotter = Spotter(Settings())
        return lambda image: spotter.spot(image, "person")
    hog = HogDetector()
    return lambda image: detect(hog, image, is_probability=False)


@dataclass
class Robot:
    """A body that pans a camera over the recording and follows what its detector finds."""

    kind: str = "colour"
    latency_s: float = 0.2
    """Mean time from an image to its detections; the next image is taken when they are there."""
    detects: str = "people"
    """Who detects: see `detector`."""
    begins_s: float = 1.0
    """When detecting and tracking begin, after the stream did."""
    has_odometry: bool = True
    obedience: Obedience = float
    seed: int = 0
    headings: list[tuple[float, float]] = field(default_factory=list)
    frames: list[tuple[float, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        view = View()
        self._lens, self._model = Lens(CLIP, view), camera_model(view)
        self._score = Score.of(CLIP, hold_s=HOLD_S)
        self._detect = detector(self.detects)
        self._follower = Follower(Gains())
        self._dice = random.Random(self.seed)
        self._motion = Motion()
        self._command: Command | None = None
        self._pending: tuple[float, Detections] | None = None

    def run(self, seconds: float) -> Robot:
        """Let simulated time pass."""
        for step in range(round(seconds / STEP_S)):
            self._pass(step * STEP_S, is_frame_due=step % 2 == 0)
        return self

    def _pass(self, now_s: float, *, is_frame_due: bool) -> None:
        self._motion = moved(self._motion, self._command, now_s=now_s, dt_s=STEP_S, limits=Limits())
        self.headings.append((now_s, self._motion.heading))
        if is_frame_due:
            self._show(now_s)
        if now_s >= self.begins_s:
            self._track(now_s)

    def _show(self, now_s: float) -> None:
        number = self._score.frame_at(now_s)
        self.frames.append((now_s, number))
        if now_s < self.begins_s or self._pending:
            return  # newest wins: a busy detector sees nothing of this frame
        seen = self._lens.look(camera(self.kind)(number), self._motion.heading)
        encoding = "bgr8" if seen.ndim == 3 else "mono8"
        image = Image.from_array(Header(now_s, "body", number), seen, encoding, self._model)
        takes_s = self.latency_s * self._dice.uniform(0.7, 1.3)
        self._pending = (now_s + takes_s, self._detect(image))

    def _track(self, now_s: float) -> None:
        if self.has_odometry:
            self._follower.heading.measured(now_s, self._motion.heading)
        if self._pending and self._pending[0] <= now_s:
            _, found = self._pending
            self._pending = None
            seen = sightings(found, "person", to_body=lambda b: b, field_of_view_deg=70.0)
            self._follower.saw(seen, found.header.stamp_s)
        asked = self._follower.command(now_s)
        self._command = Command(now_s, asked.speed_m_s, self.obedience(asked.turn_rad_s))
