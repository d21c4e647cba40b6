"""When and in which frame a message was sensed (std_msgs/Header)."""

from __future__ import annotations

import time
from dataclasses import field

from nondum.sdk.frozen import frozen


@frozen
class Header:
    """Stamp and frame of a message."""

    stamp_s: float = field(default_factory=time.monotonic)
    """Seconds on the host's monotonic clock: comparable within one host only. A stream of another
    host arrives with stamps on the clock of the host where it is read."""
    frame_id: str = ""
    """The frame that geometry is in: a unit's object name, or a host's name for its body."""
    seq: int = 0
    """Counts up in one stream, where its producer counts."""
