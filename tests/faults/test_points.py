"""The campaign counts each fault point by its name: two points with one name would count as one."""

from __future__ import annotations

from tests.faults.points import boundaries


def test_no_two_points_have_the_same_name() -> None:
    names = [point.name for point in boundaries(times=2)]
    assert sorted(set(names)) == sorted(names)
