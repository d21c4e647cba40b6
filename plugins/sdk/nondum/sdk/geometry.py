"""Frames and the way between them: pure, without numpy.

Axes are those of REP-103: x forward, y left, z up; metres and radians. A frame is a unit's object
name, or a host's name for its body.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import singledispatchmethod
from typing import Any, TypeVar

from nondum.sdk.errors import FrameUnknown, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.messages import Bearing, Message, Pose, Quaternion, Twist, Vector

IDENTITY_ROTATION: Quaternion = (0.0, 0.0, 0.0, 1.0)
_Geometric = TypeVar("_Geometric", bound=Message)


@frozen
class Transform:
    """The pose of a child frame in its parent: takes what is in the child's axes to the parent."""

    translation: Vector = (0.0, 0.0, 0.0)
    """m"""
    rotation: Quaternion = IDENTITY_ROTATION

    @classmethod
    def from_rpy(cls, translation: Vector, rpy: Vector) -> Transform:
        """Make one of roll, pitch and yaw in radians, about fixed x, y, z in this order."""
        (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a / 2), math.cos(a / 2)) for a in rpy)
        rotation = (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
        return cls(translation, rotation)

    def rotate(self, vector: Vector) -> Vector:
        """Turn a direction or velocity from the child's axes to the parent's.

        >>> quarter_left = Transform.from_rpy((0, 0, 0), (0, 0, math.pi / 2))
        >>> [round(c, 9) for c in quarter_left.rotate((1, 0, 0))]
        [0.0, 1.0, 0.0]
        """
        x, y, z, w = self.rotation
        axis = (x, y, z)
        turned = _cross(axis, vector)
        again = _cross(axis, turned)
        return _sum(vector, _scaled(turned, 2 * w), _scaled(again, 2))

    def apply(self, point: Vector) -> Vector:
        """Take a point from the child's axes to the parent's."""
        return _sum(self.rotate(point), self.translation)

    def compose(self, inner: Transform) -> Transform:
        """First `inner`, then this: grandchild → child → parent."""
        return Transform(self.apply(inner.translation), multiply(self.rotation, inner.rotation))

    def inverse(self) -> Transform:
        """The way back."""
        x, y, z, w = self.rotation
        back = Transform(rotation=(-x, -y, -z, w))
        return Transform(back.rotate(_scaled(self.translation, -1.0)), back.rotation)


class FrameTree:
    """Static transforms, child → parent; immutable.

    Raises `FrameUnknown` (FRAME_CYCLE) where a frame is its own ancestor.
    """

    def __init__(self, mounts: Mapping[str, tuple[str, Transform]]) -> None:
        self._mounts = dict(mounts)
        for frame in self._mounts:
            list(self._ancestry(frame))

    @classmethod
    def from_wire(cls, mounts: Mapping[str, Any]) -> FrameTree:
        """Make one of `{frame: [parent, xyz, xyzw]}`."""
        return cls(
            {
                frame: (parent, Transform(tuple(xyz), tuple(xyzw)))
                for frame, (parent, xyz, xyzw) in mounts.items()
            }
        )

    def between(self, frame: str, to: str) -> Transform:
        """The transform that takes what is in `frame` to `to`. Raises `FrameUnknown`."""
        if frame == to:
            return Transform()
        ours, theirs = dict(self._ancestry(frame)), dict(self._ancestry(to))
        for ancestor, up in ours.items():
            if ancestor in theirs:
                return theirs[ancestor].inverse().compose(up)
        raise FrameUnknown(
            Problem(
                "FRAME_UNKNOWN",
                f"no way is known from frame {frame!r} to {to!r}",
                fix="give the mount pose: nondum mount UNIT --xyz X Y Z --rpy R P Y",
            )
        )

    def transform(self, value: _Geometric, to: str) -> _Geometric:
        """Give a Bearing, Pose or Twist in frame `to`, with its stamp.

        A bearing is only turned: its target is taken to be far against the distance of the frames.
        A twist is that of the same rigid body at the other frame's origin.
        Raises `FrameUnknown`; `TypeError` for messages without geometry.
        """
        header = replace(value.header, frame_id=to)  # type: ignore[attr-defined]  # all three have one
        way = self.between(value.header.frame_id, to)  # type: ignore[attr-defined]  # as above
        moved = self._moved(value, way)
        return replace(moved, header=header)  # type: ignore[type-var,return-value]  # the same class

    @singledispatchmethod
    def _moved(self, value: Message, way: Transform) -> Message:
        raise TypeError(f"{type(value).__name__} has no geometry to transform")

    @_moved.register
    def _(self, value: Bearing, way: Transform) -> Message:
        return replace(value, direction=way.rotate(value.direction))

    @_moved.register
    def _(self, value: Pose, way: Transform) -> Message:
        rotation = multiply(way.rotation, value.orientation)
        return replace(value, position=way.apply(value.position), orientation=rotation)

    @_moved.register
    def _(self, value: Twist, way: Transform) -> Message:
        angular = way.rotate(value.angular)
        lever = _cross(way.translation, angular)
        return replace(value, angular=angular, linear=_sum(way.rotate(value.linear), lever))

    def _ancestry(self, frame: str) -> Iterator[tuple[str, Transform]]:
        """The frame and its ancestors, each with the transform from `frame` to it."""
        seen: set[str] = set()
        here, way = frame, Transform()
        yield here, way
        while here in self._mounts:
            seen.add(here)
            here, up = self._mounts[here]
            if here in seen:
                raise FrameUnknown(Problem("FRAME_CYCLE", f"frame {here!r} is its own ancestor"))
            way = up.compose(way)
            yield here, way


def multiply(outer: Quaternion, inner: Quaternion) -> Quaternion:
    """First the rotation `inner`, then `outer`; brought back to length 1."""
    ax, ay, az, aw = outer
    bx, by, bz, bw = inner
    product = (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
    x, y, z, w = (part / math.hypot(*product) for part in product)
    return (x, y, z, w)


def _cross(a: Vector, b: Vector) -> Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _scaled(vector: Vector, factor: float) -> Vector:
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)


def _sum(*vectors: Vector) -> Vector:
    x, y, z = (sum(parts) for parts in zip(*vectors, strict=True))
    return (x, y, z)
