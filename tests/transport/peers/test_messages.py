"""The codec of peer messages: what goes in comes out, and nothing else does."""

from __future__ import annotations

from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire_fields import MAX_ID
from nondum.transport.peers.messages import (
    MAX_CERTIFICATE,
    MAX_MESSAGE,
    Ask,
    Bye,
    Cancel,
    Failure,
    Hello,
    Message,
    Notice,
    Ping,
    Pong,
    Progress,
    Refused,
    Reply,
    Request,
    Vouch,
    Welcome,
    agreed_version,
    decode,
    encode,
)
from nondum.transport.peers.pulse import DIGEST_BYTES, State

numbers = st.integers(1, MAX_ID)
names = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=64)
leaves = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats(allow_nan=False, allow_infinity=False)
    | names
    | st.binary(max_size=50)
)
bodies = st.dictionaries(
    names, st.recursive(leaves, lambda inner: st.lists(inner, max_size=4), max_leaves=8), max_size=4
)
problems = st.builds(Problem, names, names, where=names)
digests = st.binary(min_size=DIGEST_BYTES, max_size=DIGEST_BYTES)
certificates = st.binary(max_size=1024)


def hellos(versions: st.SearchStrategy[tuple[int, ...]]) -> st.SearchStrategy[Hello]:
    return st.builds(Hello, versions, names, names, numbers, numbers, certificates)


many = st.lists(numbers, min_size=1, max_size=16).map(tuple)
messages: st.SearchStrategy[Message] = st.one_of(
    hellos(many),
    hellos(st.tuples(numbers)).map(Welcome),
    st.builds(Refused, problems),
    st.builds(Request, numbers, numbers, numbers, names, bodies),
    st.builds(Reply, numbers, bodies),
    st.builds(Failure, numbers, st.lists(problems, min_size=1, max_size=4).map(tuple)),
    st.builds(Progress, numbers, bodies),
    st.builds(Cancel, numbers),
    st.builds(Notice, names, bodies),
    st.builds(Ping, numbers, numbers, st.none() | st.builds(State, numbers, digests)),
    st.builds(Pong, numbers),
    st.builds(Bye, names),
    st.builds(Ask, numbers, names),
    st.builds(Vouch, numbers),
)


@given(messages)
def test_message_survives_the_wire(message: Message) -> None:
    assert decode(encode(message)) == message


@given(st.binary(max_size=400))
def test_any_bytes_are_a_message_or_a_violation(data: bytes) -> None:
    try:
        message = decode(data)
    except ProtocolViolation:
        return
    assert decode(encode(message)) == message


plain = st.recursive(leaves, lambda x: st.lists(x, max_size=5) | st.dictionaries(names, x))


@given(st.integers(-1, 15), st.lists(plain, max_size=7))
def test_any_list_is_a_message_or_a_violation(kind: int, fields: list[Any]) -> None:
    try:
        decode(msgpack.packb([kind, *fields]))
    except ProtocolViolation:
        return


PROBLEM = Problem("CODE", "what happened").to_dict()
HELLO = [[1], "rover", "key", 1, 1, b""]


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        (7, "PACKET_KIND"),
        ({}, "PACKET_KIND"),
        ([], "PACKET_KIND"),
        (["ping"], "PACKET_KIND"),
        ([False, *HELLO], "PACKET_KIND"),
        ([-1], "PACKET_KIND"),
        ([-3, 1], "PACKET_KIND"),
        ([14], "PACKET_KIND"),
        ([10], "PACKET_FIELDS"),
        ([10, 1, 1], "PACKET_FIELDS"),
        ([9, 1, 1, 1], "PACKET_FIELDS"),
        ([0, b"\x01", *HELLO[1:]], "PACKET_FIELDS"),
        ([0, [], *HELLO[1:]], "PACKET_FIELDS"),
        ([0, [1] * 17, *HELLO[1:]], "PACKET_FIELDS"),
        ([0, *HELLO[:-1], "text"], "PACKET_FIELDS"),
        ([0, *HELLO[:-1], b"x" * (MAX_CERTIFICATE + 1)], "PACKET_FIELDS"),
        ([1, [1, 2], *HELLO[1:]], "PACKET_FIELDS"),
        ([5, 1, []], "PACKET_FIELDS"),
        ([5, 1, PROBLEM], "PACKET_FIELDS"),
        ([5, 1, [PROBLEM] * 65], "PACKET_FIELDS"),
        ([9, 1, 1, 1, "x" * DIGEST_BYTES], "PACKET_FIELDS"),
        ([9, 1, 1, 1, b"x" * (DIGEST_BYTES - 1)], "PACKET_FIELDS"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_almost_right_is_refused(fields: Any, code: str) -> None:
    with pytest.raises(ProtocolViolation) as refused:
        decode(msgpack.packb(fields))
    assert refused.value.code == code


def test_failure_names_each_of_its_problems() -> None:
    told = (Problem("ONE", "first"), Problem("TWO", "second"))
    assert decode(encode(Failure(1, told))) == Failure(1, told)


def test_version_that_both_speak_is_agreed_on_or_none() -> None:
    assert agreed_version(Hello((99, 1), "rover", "key", 1, 1, b"")) == 1
    with pytest.raises(ProtocolViolation, match="PROTO_VERSION"):
        agreed_version(Hello((99,), "rover", "key", 1, 1, b""))


@given(messages, st.data())
def test_cut_or_lengthened_message_is_refused(message: Message, data: st.DataObject) -> None:
    encoded = encode(message)
    length = data.draw(st.integers(0, len(encoded) - 1))
    for wrong in (encoded[:length], encoded + b"\0"):
        with pytest.raises(ProtocolViolation):
            decode(wrong)


@pytest.mark.parametrize(
    "message",
    [Notice("n", {"x": "y" * MAX_MESSAGE}), Notice("n", {"x": float("nan")}), Bye("x" * 65)],
    ids=["long", "NaN", "name"],
)
def test_what_the_other_end_would_refuse_is_not_sent(message: Message) -> None:
    with pytest.raises(ProtocolViolation):
        decode(encode(message))
