"""The question who is there, and its answer."""

from __future__ import annotations

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit import version_before

from nondum.sdk.errors import ProtocolViolation
from nondum.transport.discovery import Announcement, packets
from nondum.transport.discovery.hint import Source, from_txt, to_txt
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import HostKeys

KEY = HostKeys.generate().public
LONGEST = Announcement(KEY, "n" * 63, 2**53, ("tcp://[::]:65535",), 65_535, (2**53,) * 16)

HERE = Announcement(KEY, "rover", 7, ("tcp://[::]:7410",))

nonces = st.binary(min_size=packets.NONCE, max_size=packets.NONCE)


@given(nonces)
def test_an_answer_says_what_was_announced(nonce: bytes) -> None:
    asked = packets.nonce_of(packets.question(nonce))
    assert asked == nonce
    answer = packets.read_answer(packets.answer(asked, LONGEST))
    assert (answer.nonce, answer.port) == (nonce, 65_535)
    assert answer.txt == to_txt(LONGEST)


def test_hosts_of_the_version_before_find_and_are_found() -> None:
    (question,), (answer,) = map(version_before.packets, ("question", "answer"))
    nonce = bytes(range(packets.NONCE))
    assert packets.nonce_of(question) == nonce
    found = packets.read_answer(answer)
    security = Security.DEVELOPMENT
    hint = from_txt(found.txt, found.port, ["127.0.0.1"], source=Source.STATIC, security=security)
    assert (found.nonce, hint.name, hint.versions) == (nonce, "before", (1,))


@given(nonces)
def test_no_answer_is_longer_than_its_question(nonce: bytes) -> None:
    assert len(packets.answer(nonce, LONGEST)) <= len(packets.question(nonce))


@given(st.integers(0, packets.LENGTH - 1))
def test_a_question_that_is_too_short_is_none(length: int) -> None:
    assert packets.nonce_of(packets.question(bytes(packets.NONCE))[:length]) is None


NONCE = bytes(packets.NONCE)
SOUND = packets.answer(NONCE, HERE)
LONG = msgpack.packb([7410, {str(number): "x" * 250 for number in range(4)}])


@pytest.mark.parametrize(
    "data",
    [packets.question(NONCE)[:8] + SOUND[8:], SOUND[: 8 + packets.NONCE], SOUND[:8] + NONCE + LONG],
    ids=["a question", "nothing after the nonce", "long"],
)
def test_what_is_not_the_answer_is_refused(data: bytes) -> None:
    assert packets.read_answer(SOUND).port == 7410
    with pytest.raises(ProtocolViolation):
        packets.read_answer(data)


@given(st.binary(max_size=600), st.booleans())
def test_anything_else_is_a_violation(data: bytes, is_headed: bool) -> None:
    start = packets.answer(bytes(packets.NONCE), LONGEST)[: 8 + packets.NONCE] if is_headed else b""
    try:
        answer = packets.read_answer(start + data)
    except ProtocolViolation as error:
        assert error.code == "HINT_MALFORMED"
    else:
        assert type(answer.port) is int
        assert all(type(text) is str for pair in answer.txt.items() for text in pair)
