"""Records streams of the host while a stage runs, for the scorer."""

from __future__ import annotations

import asyncio
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from nondum.host.control.client import ControlClient
from nondum.host.control.tap import messages
from nondum.sdk.errors import NondumError
from nondum.sdk.messages import Image, Message, Pose


@dataclass
class StreamRecord:
    """How the body moved, and numbers of the frames shown, each with its stamp (monotonic)."""

    headings: list[tuple[float, float]] = field(default_factory=list)
    """Stamp, yaw in radians."""
    frames: list[tuple[float, int]] = field(default_factory=list)
    places: list[tuple[float, float, float]] = field(default_factory=list)
    """Stamp, metres along two axes."""

    def on_message(self, message: Message) -> None:
        """Keep what the scorer needs of a message."""
        if isinstance(message, Image):
            self.frames.append((message.header.stamp_s, message.header.seq))
        elif isinstance(message, Pose):
            stamp_s, (x, y, _) = message.header.stamp_s, message.position
            self.headings.append((stamp_s, _yaw(message)))
            self.places.append((stamp_s, x, y))


@contextmanager
def listening(control: Path, *streams: str) -> Iterator[StreamRecord]:
    """Hear streams from now until the context ends."""
    heard, stop = StreamRecord(), threading.Event()
    threads = [
        threading.Thread(
            target=lambda stream=stream: asyncio.run(_listen(control, stream, heard, stop)),
            daemon=True,
        )
        for stream in streams
    ]
    for thread in threads:
        thread.start()
    try:
        yield heard
    finally:
        stop.set()


async def _listen(control: Path, stream: str, heard: StreamRecord, stop: threading.Event) -> None:
    try:
        with ControlClient(control) as client:
            async for message in messages(client, stream):
                if stop.is_set():
                    return
                heard.on_message(message)
    except NondumError:
        pass  # the stream or the host is gone: there is no more to hear


def _yaw(pose: Pose) -> float:
    x, y, z, w = pose.orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
