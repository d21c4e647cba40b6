"""How much is under way: never more than two frames, whatever is sent and handled."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum.transport.streams.window import FRAMES, SMALL_BYTES, SMALL_MESSAGES, Window

FRAME = 900_000


def test_two_frames_keep_the_link_busy() -> None:
    window = Window()
    window.sent(1, FRAME, 0.0)
    assert window.can_send
    window.sent(2, FRAME, 0.0)
    assert not window.can_send
    assert window.handled(1, 0.01, round_trip_s=0.001)
    assert window.can_send


def test_frames_that_fill_a_slow_link_go_one_at_a_time() -> None:
    window = Window()
    window.sent(1, FRAME, 0.0)
    window.handled(1, 0.5, round_trip_s=0.002)
    window.sent(2, FRAME, 0.5)
    assert not window.can_send
    window.handled(2, 0.53, round_trip_s=0.002)
    window.sent(3, FRAME, 0.53)
    assert window.can_send


def test_long_way_is_not_a_slow_link() -> None:
    window = Window()
    window.sent(1, FRAME, 0.0)
    window.handled(1, 0.35, round_trip_s=0.3)
    window.sent(2, FRAME, 0.35)
    assert window.can_send


def test_small_messages_do_not_wait_for_each_other() -> None:
    window = Window()
    for seq in range(1, SMALL_MESSAGES + 1):
        assert window.can_send
        window.sent(seq, 100, 0.0)
    assert not window.can_send


def test_only_the_next_can_be_handled() -> None:
    window = Window()
    window.sent(1, 10, 0.0)
    window.sent(2, 10, 0.0)
    assert not window.handled(2, 0.1, 0.0)
    assert window.handled(1, 0.1, 0.0)
    assert not window.handled(1, 0.1, 0.0)
    assert window.handled(2, 0.1, 0.0)
    assert not window.handled(3, 0.1, 0.0)


@given(st.lists(st.one_of(st.integers(1, 2 * FRAME), st.none()), max_size=200))
def test_little_is_under_way(steps: list[int | None]) -> None:
    """Numbers are lengths of messages that want to be sent, None is one that is handled."""
    window, lengths, seq, now_s = Window(), dict[int, int](), 0, 0.0
    for step in steps:
        now_s += 0.01
        if step is None and lengths:
            oldest = min(lengths)
            del lengths[oldest]
            assert window.handled(oldest, now_s, 0.001)
        elif step is not None and window.can_send:
            seq += 1
            lengths[seq] = step
            window.sent(seq, step, now_s)
        assert len(lengths) <= SMALL_MESSAGES
        assert sum(sorted(lengths.values())[:-FRAMES]) <= SMALL_BYTES
        assert lengths or window.can_send
