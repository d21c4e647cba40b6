"""Messages of any length arrive whole, and what is none is refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import ProtocolViolation
from nondum.sdk.pieces import Joined, cut
from nondum.sdk.wire import MAX_PACKET

LONGEST = b"a" * (MAX_PACKET - 1)
"""What a packet has of a message."""


@given(st.lists(st.integers(1, 3 * MAX_PACKET), min_size=1, max_size=4))
def test_messages_arrive_one_after_the_other(lengths: list[int]) -> None:
    joined, messages = Joined(3 * MAX_PACKET), [b"x" * length for length in lengths]
    packets = [packet for message in messages for packet in cut(message)]
    assert all(len(packet) <= MAX_PACKET for packet in packets)
    assert [found for packet in packets if (found := joined.add(packet)) is not None] == messages


@pytest.mark.parametrize(
    ("packets", "code"),
    [
        pytest.param([b"\2a"], "PACKET_MALFORMED", id="another mark"),
        pytest.param([b""], "PACKET_MALFORMED", id="no mark"),
        pytest.param([b"\0"], "PACKET_MALFORMED", id="not the last, and empty"),
        pytest.param([b"\0" + LONGEST[1:]], "PACKET_MALFORMED", id="not the last, and short"),
        pytest.param([b"\1" + LONGEST + b"aa"], "PACKET_TOO_LONG", id="too long"),
        pytest.param([b"\0" + LONGEST, b"\1aa"], "PACKET_TOO_LONG", id="too long together"),
    ],
)
def test_what_is_no_piece_is_refused(packets: list[bytes], code: str) -> None:
    joined = Joined(len(LONGEST) + 1)
    assert joined.add(b"\1" + LONGEST) == LONGEST
    with pytest.raises(ProtocolViolation) as violation:
        for packet in packets:
            joined.add(packet)
    assert violation.value.code == code
