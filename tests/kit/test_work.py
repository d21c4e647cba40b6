"""Counted work is the same each time, and grows as the work does."""

from __future__ import annotations

import sys

from tests.kit.work import steps_of


def total(count: int) -> int:
    found = 0
    for number in range(count):
        found += number
    return found


def test_same_work_is_as_many_steps() -> None:
    assert steps_of(lambda: total(100)) == steps_of(lambda: total(100))


def test_twice_the_work_is_twice_the_steps() -> None:
    assert 1.9 < steps_of(lambda: total(2000)) / steps_of(lambda: total(1000)) < 2.1


def pairs(count: int) -> int:
    return sum(total(count) for _ in range(count))


def test_work_of_pairs_is_seen() -> None:
    """That a test of linear work could fail."""
    assert steps_of(lambda: pairs(40)) > 3 * steps_of(lambda: pairs(20))


def test_other_tracers_are_put_back() -> None:
    traced = sys.gettrace()
    steps_of(lambda: total(1))
    assert sys.gettrace() is traced
