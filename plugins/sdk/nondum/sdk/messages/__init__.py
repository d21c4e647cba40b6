"""Typed messages: what streams carry and what valued facts hold.

Named after the field's standard messages (sensor_msgs, vision_msgs, geometry_msgs); axes and units
are those of REP-103: metres, radians, seconds, x forward, y left, z up. Constructors trust;
`from_wire` and `check` do not. Classes are made when they are first used: a worker needs two or
three of them, and waits at its start for each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.messages.fields import Buffer, Message

if TYPE_CHECKING:
    from nondum.sdk.messages.detections import BoundingBox2D, Detection, Detections
    from nondum.sdk.messages.header import Header
    from nondum.sdk.messages.images import CameraModel, Depth, Image
    from nondum.sdk.messages.motion import Bearing, Pose, Quaternion, Twist, Vector
    from nondum.sdk.messages.sensing import BatteryState, Covariance, GpsFix, ImuData
    from nondum.sdk.messages.signals import Audio, KeyValue, KeyValues, Points, Scalar, Text
    from nondum.sdk.messages.surroundings import LaserScan, OccupancyGrid

_HOME = {
    "BoundingBox2D": "detections",
    "Detection": "detections",
    "Detections": "detections",
    "Header": "header",
    "CameraModel": "images",
    "Depth": "images",
    "Image": "images",
    "Bearing": "motion",
    "Pose": "motion",
    "Quaternion": "motion",
    "Twist": "motion",
    "Vector": "motion",
    "BatteryState": "sensing",
    "Covariance": "sensing",
    "GpsFix": "sensing",
    "ImuData": "sensing",
    "Audio": "signals",
    "KeyValue": "signals",
    "KeyValues": "signals",
    "Points": "signals",
    "Scalar": "signals",
    "Text": "signals",
    "LaserScan": "surroundings",
    "OccupancyGrid": "surroundings",
}
"""The module of each name."""
_STREAMED = {
    "audio": "Audio",
    "battery-state": "BatteryState",
    "bearing": "Bearing",
    "depth": "Depth",
    "detections": "Detections",
    "gps-fix": "GpsFix",
    "image": "Image",
    "imu-data": "ImuData",
    "key-values": "KeyValues",
    "laser-scan": "LaserScan",
    "occupancy-grid": "OccupancyGrid",
    "points": "Points",
    "pose": "Pose",
    "scalar": "Scalar",
    "text": "Text",
    "twist": "Twist",
}
"""The classes that streams and facts are of, by type."""


def _home_of(name: str) -> object:
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


if not TYPE_CHECKING:  # a checker that saw this would take any misspelt name for good

    def __getattr__(name: str) -> object:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = _home_of(name)  # from now on without this function
        return value


class _Classes(Mapping[str, type[Message]]):
    """The streamed classes by type."""

    def __init__(self) -> None:
        self._made: dict[str, type[Message]] = {}

    def __getitem__(self, kind: str) -> type[Message]:
        if kind not in self._made:
            made = _home_of(_STREAMED[kind])
            assert isinstance(made, type) and issubclass(made, Message)
            self._made[kind] = made
        return self._made[kind]

    def __contains__(self, kind: object) -> bool:
        return kind in _STREAMED

    def __iter__(self) -> Iterator[str]:
        return iter(_STREAMED)

    def __len__(self) -> int:
        return len(_STREAMED)


MESSAGES: Mapping[str, type[Message]] = _Classes()
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
    "BatteryState",
    "Bearing",
    "BoundingBox2D",
    "Buffer",
    "CameraModel",
    "Covariance",
    "Depth",
    "Detection",
    "Detections",
    "GpsFix",
    "Header",
    "Image",
    "ImuData",
    "KeyValue",
    "KeyValues",
    "LaserScan",
    "Message",
    "OccupancyGrid",
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
