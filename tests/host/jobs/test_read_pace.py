"""Drives keep a pace, or are let go."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.jobs.read_pace import LEAST_BYTES_S, WINDOW_S, paced
from nondum.sdk.errors import DriveGone

TOTAL = 10**9


def copied(pieces: Iterable[tuple[float, int]]) -> int:
    """Bytes that were copied in pieces, each of which took some seconds. Raises `DriveGone`."""
    clock, done = [0.0], 0
    told: list[int] = []
    tell = paced(lambda phase, done, total: told.append(done), "stick", lambda: clock[0])
    for seconds, size in pieces:
        clock[0] += seconds
        done += size
        tell("copy", done, TOTAL)
    return told[-1]


def test_slow_drive_that_keeps_the_least_pace_is_read_to_its_end() -> None:
    assert copied([(1.0, 2 * LEAST_BYTES_S)] * 100) == 200 * LEAST_BYTES_S


def test_drive_may_pause() -> None:
    assert copied([(0.1, 2**20)] * 50 + [(19.0, 2**20), (0.1, 2**20)]) == 52 * 2**20


def test_drive_that_drips_is_let_go() -> None:
    with pytest.raises(DriveGone) as gone:
        copied([(0.5, 1)] * 1000)
    assert gone.value.code == "DRIVE_STALLED"
    assert gone.value.problems[0].fix


def test_drive_that_begins_well_and_drips_then_is_let_go() -> None:
    with pytest.raises(DriveGone):
        copied([(0.1, 2**20)] * 100 + [(0.5, 1)] * 100)


def test_end_of_a_file_may_drip() -> None:
    tell = paced(lambda *step: None, "stick", iter([0.0, 100.0]).__next__)
    tell("copy", TOTAL, TOTAL)


@given(st.floats(0.01, WINDOW_S), st.integers(1, LEAST_BYTES_S))
def test_nothing_slower_than_the_least_lasts_long(seconds: float, size: int) -> None:
    if size < LEAST_BYTES_S * seconds:
        with pytest.raises(DriveGone):
            copied([(seconds, size)] * (2 + int(2 * WINDOW_S / seconds)))
