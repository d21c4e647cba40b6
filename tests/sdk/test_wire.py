"""The envelope: every message survives it, and no bytes get past it."""

from __future__ import annotations

import contextlib
from typing import Any

import msgpack
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from nondum.sdk import Problem, ProtocolViolation
from nondum.sdk.wire import (
    MAX_DEPTH,
    MAX_PACKET,
    Cancel,
    Event,
    Failure,
    Hello,
    Reply,
    Request,
    Welcome,
    WireMessage,
    decode,
    encode,
    pack,
)
from nondum.sdk.wire_fields import MAX_ID

texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
names = st.text(st.characters(codec="utf-8"), min_size=1, max_size=64)
ids = st.integers(1, MAX_ID)
scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**64 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    texts,
    st.binary(max_size=50),
)
plain = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4)
)
bodies = st.dictionaries(texts, plain, max_size=5)
problems = st.builds(Problem, code=names, message=names, where=texts, need=texts, fix=texts)
messages: st.SearchStrategy[WireMessage] = st.one_of(
    st.builds(Hello, st.lists(ids, min_size=1, max_size=4).map(tuple), names, ids),
    st.builds(Welcome, ids, bodies),
    st.builds(Request, ids, names, bodies),
    st.builds(Reply, ids, bodies),
    st.builds(Failure, ids, st.lists(problems, min_size=1, max_size=3).map(tuple)),
    st.builds(Event, names, st.none() | ids, bodies),
    st.builds(Cancel, ids),
)


SAID = Problem("CODE", "what happened", where="there", need="n", have="h", fix="f")


@pytest.mark.parametrize(
    ("message", "packet"),
    [
        (Hello((2, 1), "0.1", 7), b"\x94\x00\x92\x02\x01\xa30.1\x07"),
        (Welcome(1, {"host": "rover"}), b"\x93\x01\x01\x81\xa4host\xa5rover"),
        (
            Request(3, "behave", {"a": [1, None, True]}),
            b"\x94\x02\x03\xa6behave\x81\xa1a\x93\x01\xc0\xc3",
        ),
        (Reply(3, {"b": b"\x01"}), b"\x93\x03\x03\x81\xa1b\xc4\x01\x01"),
        (
            Failure(3, (SAID, Problem("CODE", "m"))),
            b"\x93\x04\x03\x92\x86\xa4code\xa4CODE\xa7message\xadwhat happened\xa5where\xa5there"
            b"\xa4need\xa1n\xa4have\xa1h\xa3fix\xa1f\x82\xa4code\xa4CODE\xa7message\xa1m",
        ),
        (Event("flow", None, {}), b"\x94\x05\xa4flow\xc0\x80"),
        (
            Event("progress", 3, {"x": 0.5}),
            b"\x94\x05\xa8progress\x03\x81\xa1x\xcb?\xe0\x00\x00\x00\x00\x00\x00",
        ),
        (Cancel(MAX_ID), b"\x92\x06\xcf\x00 \x00\x00\x00\x00\x00\x00"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_bytes_are_those_that_other_versions_read(message: WireMessage, packet: bytes) -> None:
    assert encode(message) == packet
    assert decode(packet) == message


@given(messages)
def test_every_message_survives(message: WireMessage) -> None:
    try:
        packet = encode(message)
    except ProtocolViolation as violation:
        assert violation.code == "PACKET_TOO_DEEP"
    else:
        assert decode(packet) == message


@given(st.binary(max_size=200))
@example(b"\x93\x02\x01")
@example(b"\xc1")
def test_any_bytes_give_a_message_or_a_violation(data: bytes) -> None:
    with contextlib.suppress(ProtocolViolation):
        decode(data)


@given(messages, st.data())
def test_damaged_packets_give_a_message_or_a_violation(
    message: WireMessage, data: st.DataObject
) -> None:
    with contextlib.suppress(ProtocolViolation):
        packet = bytearray(encode(message))
        packet[data.draw(st.integers(0, len(packet) - 1))] = data.draw(st.integers(0, 255))
        decode(bytes(packet))


@given(st.lists(plain, max_size=5))
def test_any_list_gives_a_message_or_a_violation(fields: list[Any]) -> None:
    with contextlib.suppress(ProtocolViolation):
        decode(pack(fields))


def nested(levels: int) -> Any:
    value: Any = 1
    for _ in range(levels):
        value = [value]
    return value


def nested_tables(levels: int) -> Any:
    value: Any = 1
    for _ in range(levels):
        value = {"a": value}
    return value


def packed(value: Any) -> bytes:
    data: bytes = msgpack.packb(value)
    return data


@pytest.mark.parametrize(
    ("data", "code"),
    [
        pytest.param(b"", "PACKET_MALFORMED", id="empty"),
        pytest.param(packed([6, 1]) + b"\x01", "PACKET_MALFORMED", id="trailing-bytes"),
        pytest.param(b"\xdd\xff\xff\xff\xff", "PACKET_MALFORMED", id="list-longer-than-packet"),
        pytest.param(b"\xdf\xff\xff\xff\xff", "PACKET_MALFORMED", id="table-longer-than-packet"),
        pytest.param(b"\xc6\xff\xff\xff\xff", "PACKET_MALFORMED", id="bytes-longer-than-packet"),
        pytest.param(b"\x91" * 60_000 + b"\xc0", "PACKET_MALFORMED", id="deeper-than-the-parser"),
        pytest.param(packed(nested(MAX_DEPTH + 1)), "PACKET_TOO_DEEP", id="too-deep"),
        pytest.param(
            packed([1, 1, nested_tables(MAX_DEPTH)]), "PACKET_TOO_DEEP", id="tables-too-deep"
        ),
        pytest.param(b"\x92\x06\xa2\xff\xfe", "PACKET_MALFORMED", id="bad-utf-8"),
        pytest.param(b"\x92\x06\xd4\x05\x00", "PACKET_MALFORMED", id="extension"),
        pytest.param(b"\x92\x06\xd6\xff\x00\x00\x00\x01", "PACKET_MALFORMED", id="timestamp"),
        pytest.param(packed([1, 1, {"a": float("nan")}]), "PACKET_VALUE", id="nan"),
        pytest.param(packed([1, 1, {"a": float("inf")}]), "PACKET_VALUE", id="infinity"),
        pytest.param(b"\x93\x01\x01\x82\xa1a\x01\xa1a\x02", "PACKET_MALFORMED", id="same-key"),
        pytest.param(b"\x93\x01\x01\x81\xc4\x01a\x01", "PACKET_MALFORMED", id="bytes-as-key"),
        pytest.param(b"\x93\x01\x01\x81\x01\x01", "PACKET_MALFORMED", id="number-as-key"),
        pytest.param(packed([3, 1, [0] * 10_001]), "PACKET_MALFORMED", id="too-many-items"),
        pytest.param(bytes(MAX_PACKET + 1), "PACKET_TOO_LONG", id="too-long"),
        pytest.param(packed({"kind": 1}), "PACKET_KIND", id="no-list"),
        pytest.param(packed([]), "PACKET_KIND", id="no-kind"),
        pytest.param(packed([True, 1]), "PACKET_KIND", id="true-is-no-kind"),
        pytest.param(packed([7, 1]), "PACKET_KIND", id="unknown-kind"),
        pytest.param(packed([-1, 1]), "PACKET_KIND", id="negative-kind"),
        pytest.param(packed([6]), "PACKET_FIELDS", id="too-few-fields"),
        pytest.param(packed([6, 1, 1]), "PACKET_FIELDS", id="too-many-fields"),
        pytest.param(packed([6, 0]), "PACKET_FIELDS", id="id-zero"),
        pytest.param(packed([6, True]), "PACKET_FIELDS", id="id-true"),
        pytest.param(packed([6, MAX_ID + 1]), "PACKET_FIELDS", id="id-too-big"),
        pytest.param(packed([2, 1, "v" * 65, {}]), "PACKET_FIELDS", id="verb-too-long"),
        pytest.param(packed([2, 1, "", {}]), "PACKET_FIELDS", id="verb-empty"),
        pytest.param(packed([2, 1, [1], {}]), "PACKET_FIELDS", id="verb-no-text"),
        pytest.param(packed([2, 1, "v", []]), "PACKET_FIELDS", id="body-no-table"),
        pytest.param(packed([0, [], "1", 1]), "PACKET_FIELDS", id="no-versions"),
        pytest.param(packed([0, b"\1", "1", 1]), "PACKET_FIELDS", id="versions-no-list"),
        pytest.param(packed([4, 1, []]), "PACKET_FIELDS", id="no-problem"),
        pytest.param(packed([4, 1, 7]), "PACKET_FIELDS", id="problems-no-list"),
        pytest.param(packed([4, 1, [7]]), "PACKET_FIELDS", id="problem-no-table"),
        pytest.param(packed([4, 1, [{"code": "X"}]]), "PACKET_FIELDS", id="problem-no-message"),
        pytest.param(
            packed([4, 1, [{"code": "X", "message": "m", "x": ""}]]),
            "PACKET_FIELDS",
            id="problem-unknown-key",
        ),
        pytest.param(
            packed([4, 1, [{"code": "X", "message": 1}]]), "PACKET_FIELDS", id="problem-no-text"
        ),
    ],
)
def test_hostile_packets_are_refused(data: bytes, code: str) -> None:
    with pytest.raises(ProtocolViolation) as caught:
        decode(data)
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("body", "code"),
    [
        pytest.param({"a": "x" * MAX_PACKET}, "PACKET_TOO_LONG", id="too-long"),
        pytest.param({"a": [0] * 10_001}, "PACKET_TOO_LONG", id="too-many-items"),
        pytest.param(
            {"a": {str(n): 0 for n in range(10_001)}}, "PACKET_TOO_LONG", id="too-many-keys"
        ),
        pytest.param({"a": nested(MAX_DEPTH)}, "PACKET_TOO_DEEP", id="too-deep"),
        pytest.param(nested_tables(MAX_DEPTH), "PACKET_TOO_DEEP", id="tables-too-deep"),
        pytest.param({"a": float("nan")}, "PACKET_VALUE", id="nan"),
        pytest.param({"a": 2**64}, "PACKET_VALUE", id="integer-too-big"),
        pytest.param({"a": "\ud800"}, "PACKET_VALUE", id="surrogate"),
        pytest.param({1: "a"}, "PACKET_MALFORMED", id="number-as-key"),
    ],
)
def test_sender_refuses_what_the_receiver_would(body: dict[str, Any], code: str) -> None:
    with pytest.raises(ProtocolViolation) as caught:
        encode(Reply(1, body))
    assert caught.value.code == code


def test_values_that_are_no_data_are_a_mistake() -> None:
    with pytest.raises(TypeError, match="set is no plain data"):
        encode(Reply(1, {"a": {1}}))
