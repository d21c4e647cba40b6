"""Mount poses as frames, and doubts about them."""

from __future__ import annotations

import math

import pytest

from nondum.host.core.records.mount import MountPose
from nondum.host.mind.frames import frame_tree, mount_warnings, mounts_to_wire
from nondum.sdk.geometry import FrameTree
from nondum.sdk.messages import Bearing, Header

HEAD = MountPose("rover__ptu__head", (0.1, 0.0, 0.4), (0.0, 0.0, math.pi / 2), "payload")


def test_units_are_children_of_the_body() -> None:
    frames = frame_tree("rover", [HEAD])
    bearing = Bearing(Header(0.0, "rover"), (0.0, 1.0, 0.0), 0.1)
    assert frames.transform(bearing, HEAD.unit).direction == pytest.approx((1.0, 0.0, 0.0))


def test_workers_read_what_is_written() -> None:
    there = FrameTree.from_wire(mounts_to_wire("rover", [HEAD]))
    bearing = Bearing(Header(0.0, HEAD.unit), (1.0, 0.0, 0.0), 0.1)
    assert there.transform(bearing, "rover").direction == pytest.approx((0.0, 1.0, 0.0))


@pytest.mark.parametrize(
    ("xyz", "rpy", "doubt"),
    [
        ((100.0, 0.0, 0.0), (0.0, 0.0, 0.0), "metres are meant"),
        ((math.nan, 0.0, 0.0), (0.0, 0.0, 0.0), "metres are meant"),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 90.0), "radians are meant, not degrees"),
    ],
    ids=["centimetres", "nothing", "degrees"],
)
def test_implausible_mount_is_told(
    xyz: tuple[float, float, float], rpy: tuple[float, float, float], doubt: str
) -> None:
    [warning] = mount_warnings([MountPose("rover__a__b", xyz, rpy, "person")])
    assert doubt in warning


def test_plausible_mount_is_not_mentioned() -> None:
    assert mount_warnings([HEAD]) == ()
