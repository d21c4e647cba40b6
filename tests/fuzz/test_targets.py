"""From any bytes, a reader makes a value or a nondum error, soon and in little memory.

The long form goes by coverage: `python -m tests.fuzz`.
"""

from __future__ import annotations

import functools

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.fuzz.mutation import mutated
from tests.fuzz.target import Target, with_endless_numbers
from tests.fuzz.targets import TARGETS
from tests.fuzz.trial import tried

each = pytest.mark.parametrize("target", TARGETS, ids=[target.name for target in TARGETS])


@functools.cache
def seeds_of(target: Target) -> list[bytes]:
    return [*target.seeds(), *target.refused()]


@each
def test_its_seeds_are_read(target: Target) -> None:
    """Else the reader would refuse all that is mutated from them at its first check."""
    assert [tried(target, seed).refused for seed in target.seeds()] == [""] * len(target.seeds())


@each
def test_numbers_without_end_are_read_or_refused(target: Target) -> None:
    for data in with_endless_numbers(target.seeds()):
        assert tried(target, data).is_within_bounds


@each
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_any_bytes_are_read_or_refused(target: Target, data: st.DataObject) -> None:
    given_bytes = data.draw(mutated(seeds_of(target), target.tokens))
    trial = tried(target, given_bytes[: target.longest])
    assert trial.is_within_bounds
