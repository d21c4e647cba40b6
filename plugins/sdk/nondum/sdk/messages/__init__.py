"""Typed messages: what streams carry and what valued facts hold.

Named after the field's standard messages (sensor_msgs, vision_msgs, geometry_msgs); axes and units
are those of REP-103: metres, radians, seconds, x forward, y left, z up. Constructors trust;
`from_wire` and `check` do not.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.messages.detections import BoundingBox2D, Detection, Detections
from nondum.sdk.messages.fields import Buffer, Message
from nondum.sdk.messages.header import Header
from nondum.sdk.messages.images import CameraModel, Depth, Image
from nondum.sdk.messages.motion import Bearing, Pose, Quaternion, Twist, Vector
from nondum.sdk.messages.signals import Audio, Points, Scalar, Text

MESSAGES: Mapping[str, type[Message]] = MappingProxyType(
    {
        kind.TYPE: kind
        for kind in (Audio, Bearing, Depth, Detections, Image, Points, Pose, Scalar, Text, Twist)
    }
)
"""Every message class by its stream type."""


def message_from_wire(
    kind: str, header: Mapping[str, Any], buffer: Buffer | None = None
) -> Message:
    """Make the message of type `kind`. Raises `MessageInvalid` (MESSAGE_TYPE, …)."""
    if kind not in MESSAGES:
        raise MessageInvalid(Problem("MESSAGE_TYPE", f"no message type is called {kind!r}"))
    return MESSAGES[kind].from_wire(header, buffer)


def value_to_wire(value: Message) -> list[Any]:
    """The value of a valued fact as `[type, header]`.

    Raises `MessageInvalid` for values that are out of range or carry bulk bytes.
    """
    value.check()
    header, buffer = value.to_wire()
    if buffer is not None:
        raise MessageInvalid(
            Problem("MESSAGE_BULK", f"a fact cannot hold a message of type {value.TYPE}")
        )
    return [value.TYPE, header]


def value_from_wire(data: object) -> Message:
    """Make the value of a valued fact of `[type, header]`. Raises `MessageInvalid`."""
    match data:
        case [str(kind), Mapping() as header]:
            return message_from_wire(kind, header)
    raise MessageInvalid(Problem("MESSAGE_FIELD", "a value is a pair of type and header"))


__all__ = [
    "MESSAGES",
    "Audio",
    "Bearing",
    "BoundingBox2D",
    "Buffer",
    "CameraModel",
    "Depth",
    "Detection",
    "Detections",
    "Header",
    "Image",
    "Message",
    "Points",
    "Pose",
    "Quaternion",
    "Scalar",
    "Text",
    "Twist",
    "Vector",
    "message_from_wire",
    "value_from_wire",
    "value_to_wire",
]
