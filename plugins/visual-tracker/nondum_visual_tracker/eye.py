"""From a detections message to sightings relative to the body."""

from __future__ import annotations

from collections.abc import Callable

from nondum.sdk import Bearing, Depth, Detection, Detections
from nondum_visual_tracker.distance import distance_in
from nondum_visual_tracker.sighting import Sighting, apparent_height, assumed_camera, direction

Turned = Callable[[Bearing], Bearing]
"""Gives a bearing of a camera's frame in the body's frame."""

_DEPTH_AGE_S = 0.3
_SIGMA_RAD = 0.03


def sightings(
    seen: Detections,
    class_id: str,
    *,
    to_body: Turned,
    field_of_view_deg: float,
    depth: Depth | None = None,
) -> tuple[Sighting, ...]:
    """Everybody of one class in an image, azimuths relative to the body.

    A depth image counts when it is of the same camera and time. Raises what `to_body` raises.
    """
    if depth is not None and not _belong_together(seen, depth):
        depth = None
    found = (one for one in seen.detections if one.class_id == class_id)
    return tuple(_sighting(seen, one, to_body, field_of_view_deg, depth) for one in found)


def _sighting(
    seen: Detections, one: Detection, to_body: Turned, field_of_view_deg: float, depth: Depth | None
) -> Sighting:
    width, height = seen.image_width, seen.image_height
    camera = seen.camera or assumed_camera(width, height, field_of_view_deg=field_of_view_deg)
    bearing = Bearing(seen.header, direction(camera, one.box.cx, one.box.cy), _SIGMA_RAD)
    return Sighting(
        azimuth=to_body(bearing).azimuth_rad,
        height=apparent_height(camera, one.box),
        score=one.score,
        range_m=distance_in(depth, one.box, width=width, height=height) if depth else None,
    )


def _belong_together(seen: Detections, depth: Depth) -> bool:
    is_same_time = abs(seen.header.stamp_s - depth.header.stamp_s) <= _DEPTH_AGE_S
    return is_same_time and seen.header.frame_id == depth.header.frame_id
