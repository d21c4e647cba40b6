"""Replies are found however they are cut, echoed or interrupted."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum_pan_tilt_unit.replies import LimitHit, Replies, Reply

_texts = st.text("abcdefgh 0123456789.-", max_size=12).map(str.strip)
_pieces = st.one_of(
    st.builds(Reply, st.booleans(), _texts),
    st.sampled_from((LimitHit("pan"), LimitHit("tilt"))),
)


def spoken(piece: Reply | LimitHit) -> str:
    if isinstance(piece, LimitHit):
        return "!P" if piece.axis == "pan" else "!T"
    return f"{'*' if piece.is_success else '!'} {piece.text}\r\n"


@given(st.lists(_pieces, max_size=6), st.data())
def test_pieces_survive_cutting(pieces: list[Reply | LimitHit], data: st.DataObject) -> None:
    stream = "".join(f"PP {spoken(piece)}" for piece in pieces).encode()
    cut = data.draw(st.integers(0, len(stream)))
    replies = Replies()
    assert replies.feed(stream[:cut]) + replies.feed(stream[cut:]) == pieces


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("*\r\n", Reply(is_success=True, text="")),
        ("* 22\r", Reply(is_success=True, text="22")),
        ("PP * 22\r\n", Reply(is_success=True, text="22")),
        (
            "! Maximum allowable Pan position is 3090\r\n",
            Reply(is_success=False, text="Maximum allowable Pan position is 3090"),
        ),
    ],
    ids=["terse success", "query", "echoed query", "error"],
)
def test_the_manuals_own_answers_are_read(line: str, expected: Reply) -> None:
    assert Replies().feed(line.encode()) == [expected]


def test_a_reset_hits_all_four_ends() -> None:
    *hits, reply = Replies().feed(b"!T!T!P!P*\r\n")
    assert hits == [LimitHit("tilt")] * 2 + [LimitHit("pan")] * 2
    assert reply == Reply(is_success=True, text="")
