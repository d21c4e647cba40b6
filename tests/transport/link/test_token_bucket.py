"""A bucket lets through what its rate and burst allow, never more."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum.transport import TokenBucket

STEPS = st.lists(st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 10.0)), max_size=50)


@given(st.floats(0.1, 100.0), st.floats(0.1, 100.0), STEPS)
def test_never_more_than_rate_and_burst(
    rate: float, burst: float, steps: list[tuple[float, float]]
) -> None:
    bucket, now_s, taken = TokenBucket(rate, burst, 0.0), 0.0, 0.0
    for wait_s, wanted in steps:
        now_s += wait_s
        taken += wanted if bucket.take(wanted, now_s) else 0.0
        assert taken <= burst + rate * now_s + 1e-6


def test_refused_tokens_stay_in_the_bucket() -> None:
    bucket = TokenBucket(rate=1.0, burst=2.0, now_s=0.0)
    assert not bucket.take(3.0, 0.0)
    assert bucket.take(2.0, 0.0)
