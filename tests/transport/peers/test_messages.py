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


SAID = Problem("CODE", "what happened", where="there", need="n", have="h", fix="f")


@pytest.mark.parametrize(
    ("message", "encoded"),
    [
        (
            Hello((2, 1), "rover", "key", 5, 1, b"cert"),
            b"\x97\x00\x92\x02\x01\xa5rover\xa3key\x05\x01\xc4\x04cert",
        ),
        (
            Welcome(Hello((2,), "lamp", "yek", 6, 2, b"")),
            b"\x97\x01\x91\x02\xa4lamp\xa3yek\x06\x02\xc4\x00",
        ),
        (
            Refused(SAID),
            b"\x92\x02\x86\xa4code\xa4CODE\xa7message\xadwhat happened\xa5where\xa5there"
            b"\xa4need\xa1n\xa4have\xa1h\xa3fix\xa1f",
        ),
        (
            Request(7, 3, 1500, "behave", {"a": 1}),
            b"\x96\x03\x07\x03\xcd\x05\xdc\xa6behave\x81\xa1a\x01",
        ),
        (Reply(7, {}), b"\x93\x04\x07\x80"),
        (
            Failure(7, (Problem("CODE", "m"), Problem("CODE", "m", fix="f"))),
            b"\x93\x05\x07\x92\x82\xa4code\xa4CODE\xa7message\xa1m"
            b"\x83\xa4code\xa4CODE\xa7message\xa1m\xa3fix\xa1f",
        ),
        (
            Progress(7, {"done": 0.5}),
            b"\x93\x06\x07\x81\xa4done\xcb?\xe0\x00\x00\x00\x00\x00\x00",
        ),
        (Cancel(7), b"\x92\x07\x07"),
        (Notice("news", {"b": []}), b"\x93\x08\xa4news\x81\xa1b\x90"),
        (Ping(4), b"\x93\t\x04\xcd\x01,"),
        (
            Ping(4, 250, State(9, bytes(range(8)))),
            b"\x95\t\x04\xcc\xfa\t\xc4\x08\x00\x01\x02\x03\x04\x05\x06\x07",
        ),
        (Pong(4), b"\x92\n\x04"),
        (Bye("end"), b"\x92\x0b\xa3end"),
        (Ask(2, "key"), b"\x93\x0c\x02\xa3key"),
        (Vouch(2), b"\x92\r\x02"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_bytes_are_those_that_other_versions_read(message: Message, encoded: bytes) -> None:
    assert encode(message) == encoded
    assert decode(encoded) == message


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
    assert agreed_version(Hello((99, 1), "rover", "key", 1, 1, b""), "base") == 1
    with pytest.raises(ProtocolViolation, match="PROTO_VERSION"):
        agreed_version(Hello((99,), "rover", "key", 1, 1, b""), "base")


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
