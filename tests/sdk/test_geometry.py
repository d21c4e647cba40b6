"""Frames: transforms compose, invert, and carry bearings, poses and twists."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk import (
    Bearing,
    FrameTree,
    FrameUnknown,
    Header,
    Pose,
    Text,
    Transform,
    Twist,
    Vector,
)
from nondum.sdk.geometry import multiply

metres = st.floats(-100, 100)
vectors = st.tuples(metres, metres, metres)
angles = st.floats(-math.pi, math.pi)
transforms = st.builds(Transform.from_rpy, vectors, st.tuples(angles, angles, angles))
HALF_PI = math.pi / 2


def near(expected: Vector) -> object:
    return pytest.approx(expected, abs=1e-6)


@given(transforms, transforms, vectors)
def test_composing_is_applying_one_after_the_other(
    outer: Transform, inner: Transform, point: Vector
) -> None:
    assert outer.compose(inner).apply(point) == near(outer.apply(inner.apply(point)))


@given(transforms, vectors)
def test_inverse_leads_back(transform: Transform, point: Vector) -> None:
    assert transform.inverse().apply(transform.apply(point)) == near(point)


@given(transforms, vectors)
def test_rotation_keeps_lengths(transform: Transform, vector: Vector) -> None:
    assert math.hypot(*transform.rotate(vector)) == pytest.approx(math.hypot(*vector))


@pytest.mark.parametrize(
    ("rpy", "forward", "left"),
    [
        ((0, 0, HALF_PI), (0, 1, 0), (-1, 0, 0)),
        ((0, HALF_PI, 0), (0, 0, -1), (0, 1, 0)),
        ((HALF_PI, 0, 0), (1, 0, 0), (0, 0, 1)),
        ((HALF_PI, 0, HALF_PI), (0, 1, 0), (0, 0, 1)),
    ],
    ids=["yaw turns left", "pitch looks down", "roll tips right", "roll goes before yaw"],
)
def test_angles_turn_the_right_way(rpy: Vector, forward: Vector, left: Vector) -> None:
    transform = Transform.from_rpy((0, 0, 0), rpy)
    assert transform.rotate((1, 0, 0)) == near(forward)
    assert transform.rotate((0, 1, 0)) == near(left)


@pytest.fixture
def frames() -> FrameTree:
    return FrameTree(
        {
            "camera": ("mast", Transform((0.0, 0.0, 1.0))),
            "mast": ("robot", Transform.from_rpy((1.0, 0.0, 0.0), (0, 0, HALF_PI))),
            "wheel": ("robot", Transform((0.0, -0.5, 0.0))),
        }
    )


def test_bearing_is_turned_only(frames: FrameTree) -> None:
    seen = Bearing(Header(5.0, "camera", 3), (1.0, 0.0, 0.0), 0.1)
    moved = frames.transform(seen, "wheel")
    assert moved.direction == near((0, 1, 0))
    assert moved.header == Header(5.0, "wheel", 3)
    assert moved.sigma_rad == 0.1


def test_pose_is_moved_and_turned(frames: FrameTree) -> None:
    seen = Pose(Header(frame_id="camera"), (2.0, 0.0, 0.0), child_frame_id="thing")
    moved = frames.transform(seen, "wheel")
    assert moved.position == near((1.0, 2.5, 1.0))
    assert moved.yaw_rad == pytest.approx(HALF_PI)
    assert moved.child_frame_id == "thing"


def test_twist_is_the_same_motion_elsewhere(frames: FrameTree) -> None:
    spin = Twist(Header(frame_id="robot"), angular=(0.0, 0.0, 2.0))
    at_wheel = frames.transform(spin, "wheel")
    assert at_wheel.linear == near((1.0, 0.0, 0.0)), "half a metre to the right, turning left"
    assert at_wheel.angular == near((0.0, 0.0, 2.0))
    assert frames.transform(at_wheel, "robot").linear == near((0, 0, 0))


def test_frame_without_a_way_is_unknown(frames: FrameTree) -> None:
    with pytest.raises(FrameUnknown, match=r"'camera' .*'moon'"):
        frames.transform(Bearing(Header(frame_id="camera"), (1.0, 0.0, 0.0), 0.1), "moon")


def test_own_frame_needs_no_mount() -> None:
    twist = Twist(Header(frame_id="anywhere"), (1.0, 0.0, 0.0))
    assert FrameTree({}).transform(twist, "anywhere") == twist


def test_cycles_are_refused() -> None:
    with pytest.raises(FrameUnknown, match="FRAME_CYCLE"):
        FrameTree({"a": ("b", Transform()), "b": ("a", Transform())})


def test_messages_without_geometry_are_a_mistake(frames: FrameTree) -> None:
    with pytest.raises(TypeError, match="Text has no geometry"):
        frames.transform(Text(Header(frame_id="camera"), "left"), "robot")


def test_mount_table_of_the_wire_is_read() -> None:
    frames = FrameTree.from_wire({"head": ["robot", [1, 2, 3], [0, 0, 0, 1]]})
    assert frames.between("head", "robot").apply((0, 0, 0)) == near((1, 2, 3))


@given(transforms, transforms)
def test_products_of_rotations_stay_rotations(one: Transform, other: Transform) -> None:
    assert math.hypot(*multiply(one.rotation, other.rotation)) == pytest.approx(1)
