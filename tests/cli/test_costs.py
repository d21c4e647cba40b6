"""Of a large payload it is said which kinds of hosts take how much."""

from __future__ import annotations

import pytest

from nondum.cli.costs import remark, row
from nondum.wheelhouse.build.cost import LARGE_BYTES, Cost
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.format.target import Target

MB = 1 << 20
ARM = Cost(Target("aarch64", "3.12"), 90 * MB, 80 * MB)
X86 = Cost(Target("x86_64", "3.12"), 60 * MB, 50 * MB)


def listed(size: int) -> Contents:
    entries = (Entry("0" * 64, size, "wheels/a-1-py3-none-any.whl"),)
    return Contents("org.example.lamp", "1", 1, "", "0.1", "2026-01-01T00:00:00Z", entries)


def test_the_dearest_is_named_first_and_what_is_shared_at_last() -> None:
    told = remark(listed(140 * MB), (ARM, X86))
    sizes = ("140.0 MB", "80.0 MB", "aarch64", "50.0 MB", "x86_64", "10.0 MB")
    places = [told.index(size) for size in sizes]
    assert places == sorted(places)


@pytest.mark.parametrize(
    ("size", "costs", "is_told"),
    [
        pytest.param(LARGE_BYTES, (ARM, X86), True, id="large"),
        pytest.param(LARGE_BYTES - 1, (ARM, X86), False, id="small"),
        pytest.param(LARGE_BYTES, (ARM,), False, id="for one"),
    ],
)
def test_only_a_large_saving_is_told(size: int, costs: tuple[Cost, ...], is_told: bool) -> None:
    assert bool(remark(listed(size), costs)) == is_told


def test_programs_are_told_bytes() -> None:
    assert row(ARM) == {
        **{"arch": "aarch64", "python": "3.12"},
        **{"bytes": 90 * MB, "own_bytes": 80 * MB},
    }
