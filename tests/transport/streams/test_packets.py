"""What bridges say survives the wire, and whatever else comes is refused in words."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit import version_before

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire import pack
from nondum.transport.streams import packets
from nondum.transport.streams.packets import (
    MAX_ASKED,
    MAX_BULK,
    PIECE,
    Asked,
    Claim,
    Coding,
    Frame,
    Handled,
    Opened,
    Over,
    Ping,
    Pong,
)

NUMBERS = st.integers(1, 2**53)
NAMES = st.text(st.characters(codec="ascii"), min_size=1, max_size=64)
CLOCKS = st.floats(allow_nan=False, allow_infinity=False)
ASKED = st.one_of(
    st.builds(Claim, NUMBERS, NAMES), st.builds(Handled, NUMBERS), st.builds(Ping, CLOCKS)
)
HEADERS = st.dictionaries(NAMES, st.one_of(st.integers(-100, 100), NAMES), max_size=4)
PIECES = st.one_of(
    st.just(()), st.integers(0, 3 * PIECE).map(lambda length: packets.cut(bytes(length)))
)
FRAMES = st.builds(Frame, NUMBERS, st.sampled_from(Coding), HEADERS, PIECES)
PROBLEMS = st.builds(Problem, NAMES, NAMES)
TOLD = st.one_of(
    st.builds(Opened, NAMES), st.builds(Pong, CLOCKS, CLOCKS), st.builds(Over, PROBLEMS)
)
ANYTHING = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(-(2**63), 2**64 - 1), st.text(), st.binary()),
    lambda inner: st.one_of(st.lists(inner), st.dictionaries(st.text(), inner)),
    max_leaves=8,
)


@given(ASKED)
def test_what_a_reader_says_survives(message: Asked) -> None:
    assert packets.read_asked(packets.asked(message)) == message


@given(TOLD)
def test_what_an_owner_says_survives(message: Opened | Pong | Over) -> None:
    assert packets.read_told([packets.told(message)]) == message


def test_bridge_of_the_version_before_is_understood() -> None:
    asked = {"claim": Claim(1, "token"), "handled": Handled(2), "ping": Ping(1.5)}
    for name, message in asked.items():
        assert packets.read_asked(*version_before.packets(name)) == message
    over = Over(Problem("STREAM_GONE", "it has ended"))
    frame = Frame(2, Coding.RAW, {"width": 2, "height": 1}, (b"ab",))
    told = {"opened": Opened("text"), "pong": Pong(1.5, 2.5), "over": over, "frame": frame}
    for name, message in told.items():
        assert packets.read_told(version_before.packets(name)) == message


@given(FRAMES)
def test_frame_survives(frame: Frame) -> None:
    assert packets.read_told([packets.head(frame), *frame.pieces]) == frame


@given(st.integers(0, 3 * PIECE))
def test_pieces_are_the_whole(length: int) -> None:
    assert b"".join(packets.cut(bytes(length))) == bytes(length)


@given(st.one_of(st.binary(), ANYTHING.map(lambda value: pack(value))))
def test_anything_else_is_a_violation(data: bytes) -> None:
    for read in (lambda: packets.read_asked(data), lambda: packets.read_told([data, b"bulk"])):
        with contextlib.suppress(ProtocolViolation):
            assert isinstance(read(), Asked | Frame)


@pytest.mark.parametrize(
    "parts",
    [
        [],
        [pack([2, 1, 0, {}]), b"short", b"more"],
        [pack([2, 1, 0, {}]), bytes(PIECE + 1)],
        [pack([2, 1, 0, {}]), *[bytes(PIECE)] * (MAX_BULK // PIECE), b"more"],
        [pack([1, "image"]), b"bulk"],
        [pack([2, 1, 7, {}])],
        [pack([2, 1, True, {}])],
        [pack([2, 0, 0, {}])],
        [pack([3, 1, 2])],
        [b"\x93\x03\xcb?\xf0\0\0\0\0\0\0\xcb\x7f\xf0\0\0\0\0\0\0"],
        [pack([4, {"code": "X"}])],
    ],
    ids=[
        "nothing",
        "piece-short",
        "piece-long",
        "pieces-many",
        "bulk",
        "coding",
        "bool",
        "seq",
        "clock",
        "endless",
        "problem",
    ],
)
def test_almost_right_is_wrong(parts: list[bytes]) -> None:
    with pytest.raises(ProtocolViolation):
        packets.read_told(parts)


def test_reader_is_short() -> None:
    with pytest.raises(ProtocolViolation, match="PACKET_TOO_LONG"):
        packets.read_asked(pack([1, 1, "x" * MAX_ASKED]))
