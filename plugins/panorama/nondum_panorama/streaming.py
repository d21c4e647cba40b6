"""The behaviour `stream`: a recording, or a real camera, as a stream of images."""

from __future__ import annotations

import asyncio
import itertools
import math
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from nondum.sdk import BehaviourFailed, CameraModel, Context, Header, Image, Problem
from nondum_panorama.capture import Capture
from nondum_panorama.clip import Clip
from nondum_panorama.heading import BodyHeading
from nondum_panorama.playing import Score
from nondum_panorama.recording import Frame, Recording, Tell, not_told
from nondum_panorama.settings import CameraSettings
from nondum_panorama.view import Lens, View

STEPS = 20
"""Number of progress reports while a recording is read."""
FrameSource = Callable[[int], Frame]
"""Gives the full frame of a number: colour, or whatever a camera makes of it."""

_T = TypeVar("_T")
_ENCODINGS = {2: "mono8", 3: "bgr8"}


async def play(
    ctx: Context, slot: str, settings: CameraSettings, clip: Clip, frames: FrameSource
) -> None:
    """Play a clip as a camera that pans with the body, until halted.

    Reads the optional input `odometry`; the recording hangs where the body faced when the stream
    began. `header.seq` is the number of the source frame.
    """
    output, odometry = ctx.output(slot), ctx.optional_input("odometry")
    lens, heading = Lens(clip, settings.view), BodyHeading()
    camera, looks = camera_model(settings.view), math.radians(settings.looks_deg)
    score = Score.of(clip, hold_s=settings.hold_s, speed=settings.speed)
    async for elapsed_s in _ticks(settings, score.frames_per_s):
        pose = odometry.latest
        if pose is not None and pose.child_frame_id in ("", ctx.host):
            heading.update(pose)
        stamp_s, number = time.monotonic(), score.frame_at(elapsed_s)
        azimuth = heading.at(stamp_s) + looks
        seen = await asyncio.to_thread(_seen, lens, frames, number, azimuth)
        header = Header(stamp_s=stamp_s, frame_id=ctx.unit, seq=number)
        output.send(Image.from_array(header, seen, _ENCODINGS[seen.ndim], camera))
        if elapsed_s == 0:
            await ctx.established()


async def relay(ctx: Context, slot: str, settings: CameraSettings, node: str) -> None:
    """Stream the images of a V4L2 camera until halted.

    Fails with CAMERA_FAILED when it cannot be opened or gives no more images.
    """
    output, count = ctx.output(slot), itertools.count()
    with _opened(node) as capture:
        while True:
            seen = await asyncio.to_thread(capture.read)
            stamp_s = time.monotonic()
            if seen is None:
                raise _camera_failed(node, "gives no images")
            number = next(count)
            model = camera_model(View(seen.shape[1], seen.shape[0], settings.field_of_view_deg))
            header = Header(stamp_s=stamp_s, frame_id=ctx.unit, seq=number)
            output.send(Image.from_array(header, seen, _ENCODINGS[seen.ndim], model))
            if number == 0:
                await ctx.established()


def _seen(lens: Lens, frames: FrameSource, number: int, azimuth: float) -> Frame:
    return lens.look(frames(number), azimuth)


def camera_model(view: View) -> CameraModel:
    """The pinhole model that images of a view carry."""
    cx, cy = view.centre
    return CameraModel(view.width, view.height, view.focal_px, view.focal_px, cx, cy)


async def opened(progress: Callable[[float, str], None], opening: Callable[[Tell], _T]) -> _T:
    """Have `opening` read a recording in a thread, and return what it gives.

    `progress` is called on the loop: a small computer may need longer than a behaviour may take
    without a sign of progress. If this is cancelled, the thread ends with the next frame.
    """
    loop, told, is_over = asyncio.get_running_loop(), 0, False

    def say(done: float) -> None:
        if not is_over:
            progress(done, "reads the recording")

    def tell(done: float) -> None:
        nonlocal told
        if is_over:
            raise _Halted
        if int(done * STEPS) > told:
            told = int(done * STEPS)
            loop.call_soon_threadsafe(say, done)

    try:
        return await asyncio.to_thread(opening, tell)
    finally:
        is_over = True


class _Halted(Exception):
    """Ends a thread whose result is no longer wanted."""


def open_recording(clip: Clip, tell: Tell = not_told) -> Recording:
    """Read a clip's stretch. Fails with RECORDING_UNREADABLE."""
    try:
        return Recording.open(clip.video, clip.first, clip.last, tell)
    except OSError as error:
        raise BehaviourFailed(Problem("RECORDING_UNREADABLE", str(error))) from error


async def _ticks(settings: CameraSettings, frames_per_s: float) -> AsyncIterator[float]:
    """Seconds into the score, one value per image, paced; begins with 0."""
    period_s = 1 / frames_per_s
    began = due = time.monotonic()
    for count in itertools.count():
        is_live = settings.pace == "real-time" and count > 0
        yield time.monotonic() - began if is_live else count * period_s
        due = max(due + period_s, time.monotonic())
        await asyncio.sleep(due - time.monotonic())


@contextmanager
def _opened(node: str) -> Iterator[Capture]:
    try:
        capture = Capture(node)
    except OSError as error:
        raise _camera_failed(node, "cannot be opened as a camera") from error
    try:
        yield capture
    finally:
        capture.close()


def _camera_failed(node: str, what: str) -> BehaviourFailed:
    return BehaviourFailed(
        Problem("CAMERA_FAILED", f"{node} {what}", fix="check its cable and who else uses it")
    )
