"""The order of frames."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum_panorama.clip import packaged_clip
from nondum_panorama.playing import Score

scores = st.builds(
    lambda first, span, rate, hold, rest: Score(first, first + span, rate, hold, rest),
    st.integers(0, 50),
    st.integers(0, 50),
    st.sampled_from([1.0, 10.0, 25.0]),
    st.floats(0, 3),
    st.floats(0, 2),
)


@given(scores, st.integers(0, 500))
def test_neighbours_in_time_are_neighbours_in_the_recording(score: Score, count: int) -> None:
    period = 1 / score.frames_per_s
    one, other = score.frame_at(count * period), score.frame_at((count + 1) * period)
    assert abs(one - other) <= 1
    assert score.first <= one <= score.last


@given(scores, st.floats(0, 1))
def test_first_frame_stands_still_at_first(score: Score, share: float) -> None:
    assert score.frame_at(score.hold_s * share) == score.first


def test_recording_rests_at_both_ends() -> None:
    score = Score(first=0, last=3, frames_per_s=10.0, rest_s=0.2)
    shown = [score.frame_at(step / 10) for step in range(14)]
    assert shown == [0, 1, 2, 3, 3, 3, 2, 1, 0, 0, 0, 1, 2, 3]


def test_packaged_clip_plays_as_stated() -> None:
    clip = packaged_clip()
    score = Score.of(clip, hold_s=3.0)
    leg_s = (clip.last - clip.first) / clip.frames_per_s
    assert score.frame_at(3.0 + leg_s) == score.frame_at(3.9 + leg_s) == clip.last
    assert score.frame_at(3.0 + 2 * leg_s + clip.rest_s) == clip.first


def test_slow_motion_shows_the_same_later() -> None:
    clip = packaged_clip()
    usual, slow = Score.of(clip, hold_s=3.0), Score.of(clip, hold_s=3.0, speed=0.1)
    shown = [usual.frame_at(3.0 + step / 10) for step in range(100)]
    assert [slow.frame_at(3.0 + step) for step in range(100)] == shown
