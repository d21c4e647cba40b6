"""The decoder finds every whole frame, whatever lies around it and however it is cut."""

from __future__ import annotations

import struct
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from line_bench import encoded, frame

from nondum_compton_camera.listmode import Decoder, Event, Interaction, Status, crc

_coordinates = st.integers(-32768, 32767).map(lambda n: n / 100)
_interactions = st.builds(
    Interaction,
    st.tuples(_coordinates, _coordinates, _coordinates),
    st.integers(0, 65535).map(lambda n: n / 10),
)
_events = st.builds(
    Event, st.integers(0, 2**32 - 1), st.integers(0, 2**64 - 1), _interactions, _interactions
)
EVENT = Event(7, 8, Interaction((1.5, -2.25, 3.0), 184.3), Interaction((-30.0, 0.0, 9.99), 477.4))
LONGEST = 300
"""Bytes enough to complete the longest thing that can look like a frame."""


@given(st.lists(_events, max_size=4), st.binary(max_size=40), st.data())
def test_frames_survive_garbage_and_cutting(
    events: list[Event], garbage: bytes, data: st.DataObject
) -> None:
    stream = garbage + garbage.join(encoded(event) for event in events) + bytes(LONGEST)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    decoder = Decoder()
    edges = [0, *cuts, len(stream)]
    pieces = [stream[begin:end] for begin, end in pairwise(edges)]
    assert [record for piece in pieces for record in decoder.feed(piece)] == events


@given(st.integers(1, 33))
def test_a_start_within_a_frame_costs_that_frame_only(start: int) -> None:
    decoder = Decoder()
    assert decoder.feed(encoded(EVENT)[start:] + encoded(EVENT) + bytes(LONGEST)) == [EVENT]


@given(st.integers(2, 33), st.integers(1, 255))
def test_a_damaged_frame_is_no_event(place: int, flipped: int) -> None:
    damaged = bytearray(encoded(EVENT))
    damaged[place] ^= flipped
    decoder = Decoder()
    assert decoder.feed(bytes(damaged) + encoded(EVENT) + bytes(LONGEST)) == [EVENT]
    assert decoder.discarded >= len(damaged)


def test_a_false_sync_hides_no_frame() -> None:
    decoder = Decoder()
    assert decoder.feed(b"\xeb\x90\x01\x1c" + encoded(EVENT) * 2) == [EVENT, EVENT]


def test_unknown_types_are_passed_over() -> None:
    decoder = Decoder()
    assert decoder.feed(frame(0x7F, b"later firmware") + encoded(EVENT)) == [EVENT]
    assert decoder.discarded == 0


def test_status_tells_of_lost_events() -> None:
    payload = struct.pack("<III", 61_000, 9_000, 12)
    assert Decoder().feed(frame(2, payload)) == [Status(live_ms=61_000, events=9_000, lost=12)]


@pytest.mark.parametrize(("data", "expected"), [(b"123456789", 0x29B1), (b"", 0xFFFF)])
def test_checksum_is_the_published_one(data: bytes, expected: int) -> None:
    assert crc(data) == expected
