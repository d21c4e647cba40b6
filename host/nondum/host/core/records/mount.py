"""Where units sit."""

from __future__ import annotations

from nondum.sdk.frozen import frozen

Xyz = tuple[float, float, float]


@frozen
class MountPose:
    """Where a unit sits in its host's body frame (REP-103: x forward, y left, z up)."""

    unit: str
    """Full object name; also the frame's name."""
    xyz: Xyz
    """Metres."""
    rpy: Xyz
    """Roll, pitch, yaw in radians."""
    origin: str
    """`person` (set on this host; outlives the component) or `payload` (its default)."""
