"""Values survive as plain data, and what is wrong in plain data is refused with its place."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, NewType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.codec.checks import Bounds, Mismatch, matching
from nondum.sdk.codec.values import OMIT_DEFAULT, from_plain, reader, to_plain
from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.packet_codec import FLAT, PacketCodec

Key = NewType("Key", str)


class Colour(Enum):
    RED = "red"
    ONE = 1


@dataclass(frozen=True, slots=True)
class Lamp:
    name: Annotated[str, Bounds(1, 8)]
    of: str = field(default="", metadata=OMIT_DEFAULT)


@dataclass(frozen=True, slots=True)
class Everything:
    key: Key
    text: Annotated[str, matching(re.compile("[a-z]*"))]
    whole: Annotated[int, Bounds(-5, 2**53)]
    number: Annotated[float, Bounds(-1e9, 1e9)]
    is_on: bool
    data: Annotated[bytes, Bounds(0, 8)]
    path: Path
    colour: Colour
    optional: int | None
    lamps: Annotated[tuple[Lamp, ...], Bounds(0, 3)]
    pair: tuple[str, float]
    names: frozenset[str]
    table: Mapping[str, Lamp | None]
    anything: Any
    more: Mapping[str, Any] = field(default_factory=dict)


texts = st.text(max_size=8)
scalars = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | texts
anything = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3)
)
lamps = st.builds(Lamp, st.text(min_size=1, max_size=8), texts)
numbers = st.floats(-1e9, 1e9)
values = st.builds(
    Everything,
    key=texts,
    text=st.from_regex("[a-z]*", fullmatch=True),
    whole=st.integers(-5, 2**53),
    number=numbers,
    is_on=st.booleans(),
    data=st.binary(max_size=8),
    path=st.sampled_from(("/", "a/b")).map(Path),
    colour=st.sampled_from(Colour),
    optional=st.none() | st.integers(),
    lamps=st.lists(lamps, max_size=3).map(tuple),
    pair=st.tuples(texts, numbers),
    names=st.frozensets(texts, max_size=3),
    table=st.dictionaries(texts, st.none() | lamps, max_size=3),
    anything=anything,
    more=st.dictionaries(texts, anything, max_size=3),
)
SOME = Everything(
    key=Key("k"),
    text="t",
    whole=1,
    number=0.5,
    is_on=True,
    data=b"d",
    path=Path("p"),
    colour=Colour.RED,
    optional=None,
    lamps=(Lamp("a"), Lamp("b", of="base")),
    pair=("x", 1.0),
    names=frozenset("ab"),
    table={"c": Lamp("c")},
    anything=[None],
)
PLAIN = {
    "key": "k",
    "text": "t",
    "whole": 1,
    "number": 0.5,
    "is_on": True,
    "data": b"d",
    "path": "p",
    "colour": "red",
    "optional": None,
    "lamps": [{"name": "a"}, {"name": "b", "of": "base"}],
    "pair": ["x", 1.0],
    "names": ["a", "b"],
    "table": {"c": {"name": "c"}},
    "anything": [None],
    "more": {},
}


def test_value_is_written_as_tables_lists_and_scalars() -> None:
    assert to_plain(SOME) == PLAIN


@given(values)
def test_every_value_survives(value: Everything) -> None:
    assert from_plain(Everything, to_plain(value)) == value


@given(st.sampled_from(sorted(PLAIN)), anything)
def test_what_is_read_is_what_was_written(name: str, wrong: Any) -> None:
    """Where a field is read at all, another value of it cannot have been meant."""
    data = {**PLAIN, name: wrong}
    try:
        value = from_plain(Everything, data)
    except Mismatch as mismatch:
        assert mismatch.place.startswith(f".{name}")
    else:
        assert from_plain(Everything, to_plain(value)) == value


@pytest.mark.parametrize(
    ("change", "place", "reason"),
    [
        pytest.param({"whole": True}, "whole", "expected a whole number, found bool", id="true"),
        pytest.param({"whole": 1.0}, "whole", "expected a whole number", id="no-whole-number"),
        pytest.param({"whole": -6}, "whole", "a number from -5 to", id="below"),
        pytest.param({"is_on": 1}, "is_on", "expected true or false, found int", id="one"),
        pytest.param({"number": True}, "number", "expected a number, found bool", id="true-float"),
        pytest.param({"number": "1"}, "number", "expected a number, found str", id="digits"),
        pytest.param({"number": math.nan}, "number", "expected a finite number", id="nan"),
        pytest.param({"number": 10**400}, "number", "expected a finite number", id="huge"),
        pytest.param({"number": 2e9}, "number", "a number from -1", id="above"),
        pytest.param({"text": b"t"}, "text", "expected a text, found bytes", id="bytes"),
        pytest.param({"text": "T"}, "text", "a text like [a-z]*, found 'T'", id="pattern"),
        pytest.param({"data": "d"}, "data", "expected bytes, found str", id="text"),
        pytest.param({"data": bytes(9)}, "data", "a length from 0 to 8, found 9", id="too-long"),
        pytest.param({"path": 3}, "path", "expected a text, found int", id="no-path"),
        pytest.param({"colour": "blue"}, "colour", "one of 'red', 1, found 'blue'", id="no-member"),
        pytest.param({"colour": True}, "colour", "one of 'red', 1, found True", id="true-member"),
        pytest.param({"optional": ""}, "optional", "expected a whole number", id="empty"),
        pytest.param({"lamps": "ab"}, "lamps", "expected a list, found str", id="no-list"),
        pytest.param({"lamps": [{"name": "a"}] * 4}, "lamps", "a length from 0 to 3", id="many"),
        pytest.param({"lamps": [{"name": "a"}, 1]}, "lamps[1]", "a table for Lamp", id="item"),
        pytest.param({"lamps": [{"name": ""}]}, "lamps[0].name", "a length from 1", id="deep"),
        pytest.param({"lamps": [{}]}, "lamps[0]", "key 'name' is missing", id="missing-deep"),
        pytest.param({"pair": ["x"]}, "pair", "expected 2 values, found 1", id="short"),
        pytest.param({"pair": [1, 1]}, "pair[0]", "expected a text", id="first"),
        pytest.param({"table": [["c", None]]}, "table", "expected a table, found list", id="pairs"),
        pytest.param({"table": {"c": 1}}, "table['c']", "a table for Lamp", id="entry"),
        pytest.param({"table": {1: None}}, "table[1]", "expected a text", id="number-as-key"),
        pytest.param({"more": []}, "more", "expected a table, found list", id="no-table"),
        pytest.param({"names": [1]}, "names[0]", "expected a text", id="no-name"),
        pytest.param({"zoom": 1}, "", "unknown key 'zoom'; known: anything", id="unknown"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(
    change: dict[str, Any], place: str, reason: str
) -> None:
    with pytest.raises(Mismatch) as refused:
        from_plain(Everything, {**PLAIN, **change}, "here")
    assert refused.value.place == f"here.{place}".rstrip(".")
    assert reason in refused.value.reason


def test_whole_number_stands_for_a_float_and_becomes_one() -> None:
    read = from_plain(Everything, {**PLAIN, "number": 2})
    assert (read.number, type(read.number)) == (2.0, float)


@pytest.mark.parametrize("name", sorted(PLAIN.keys() - {"more"}))
def test_only_a_field_with_a_default_may_be_missing(name: str) -> None:
    with pytest.raises(Mismatch, match=f"key '{name}' is missing"):
        from_plain(Everything, {key: value for key, value in PLAIN.items() if key != name})
    assert from_plain(Everything, {k: v for k, v in PLAIN.items() if k != "more"}) == SOME


@pytest.mark.parametrize("hint", [set, complex, int | str, Mapping[int, str], list[int]], ids=str)
def test_types_that_are_not_plain_are_a_mistake(hint: Any) -> None:
    with pytest.raises(TypeError, match="no type of plain data"):
        reader(hint)


def test_reader_of_a_class_is_made_once() -> None:
    assert reader(Lamp) is reader(Lamp)


def test_problem_is_written_without_what_it_does_not_say() -> None:
    problem = Problem("CODE", "what", need="more")
    assert to_plain(problem) == {"code": "CODE", "message": "what", "need": "more"}
    assert from_plain(Problem, json.loads(json.dumps(to_plain(problem)))) == problem


@dataclass(frozen=True, slots=True)
class Nothing:
    pass


@dataclass(frozen=True, slots=True)
class Switch:
    number: Annotated[int, Bounds(1, 9)]
    lamp: Annotated[Lamp | None, FLAT] = None


def _check_of(lamp: Lamp) -> None:
    Bounds(1, 9)(lamp.of)


@dataclass(frozen=True, slots=True)
class Show:
    lamp: Annotated[Lamp, FLAT, _check_of]


@dataclass(frozen=True, slots=True)
class Paint:
    colours: tuple[Colour, ...]
    lamps: tuple[Lamp, ...]


Packet = Nothing | Switch | Show | Paint
PACKETS: PacketCodec[Packet] = PacketCodec((Nothing, Switch, Show, Paint))
packets: st.SearchStrategy[Packet] = st.one_of(
    st.just(Nothing()),
    st.builds(Switch, st.integers(1, 9), st.none() | lamps),
    st.builds(
        Show,
        st.builds(Lamp, st.text(min_size=1, max_size=8), st.text("ab", min_size=1, max_size=9)),
    ),
    st.builds(Paint, st.lists(st.sampled_from(Colour)).map(tuple), st.lists(lamps).map(tuple)),
)


@pytest.mark.parametrize(
    ("packet", "fields"),
    [
        (Nothing(), (0,)),
        (Switch(3), (1, 3)),
        (Switch(3, Lamp("a")), (1, 3, "a", "")),
        (Show(Lamp("a", "b")), (2, "a", "b")),
        (Paint((Colour.RED,), (Lamp("a"),)), (3, ["red"], [{"name": "a"}])),
    ],
    ids=str,
)
def test_packet_is_its_kind_and_its_fields(packet: Packet, fields: tuple[Any, ...]) -> None:
    assert PACKETS.fields(packet) == fields
    assert PACKETS.message(list(fields)) == packet


@given(packets)
def test_every_packet_survives(packet: Packet) -> None:
    assert PACKETS.message(list(PACKETS.fields(packet))) == packet


@given(st.lists(st.integers(-1, 5) | anything, max_size=5))
def test_any_list_is_a_packet_or_a_violation(fields: list[Any]) -> None:
    try:
        packet = PACKETS.message(fields)
    except ProtocolViolation as violation:
        assert violation.code in {"PACKET_KIND", "PACKET_FIELDS"}
    else:
        assert list(PACKETS.fields(packet)) == fields


@pytest.mark.parametrize(
    ("fields", "code", "where", "message"),
    [
        ((0,), "PACKET_KIND", "", "a list that begins with its kind"),
        ([], "PACKET_KIND", "", "a list that begins with its kind"),
        ([True], "PACKET_KIND", "", "a list that begins with its kind"),
        ([-1], "PACKET_KIND", "", "no kind of packet has the number -1"),
        ([4], "PACKET_KIND", "", "no kind of packet has the number 4"),
        ([0, 1], "PACKET_FIELDS", "Nothing", "expected 0 fields, found 1"),
        ([1, 3, "a"], "PACKET_FIELDS", "Switch", "expected 1 or 3 fields, found 2"),
        ([1, 0], "PACKET_FIELDS", "Switch.number", "expected a number from 1 to 9, found 0"),
        ([1, 3, "", ""], "PACKET_FIELDS", "Switch.name", "expected a length from 1 to 8"),
        ([2, "a", ""], "PACKET_FIELDS", "Show", "expected a length from 1 to 9, found 0"),
        ([3, [], [1]], "PACKET_FIELDS", "Paint.lamps[0]", "expected a table for Lamp"),
    ],
    ids=str,
)
def test_wrong_packets_are_refused(fields: Any, code: str, where: str, message: str) -> None:
    with pytest.raises(ProtocolViolation) as refused:
        PACKETS.message(fields)
    problem = refused.value.problems[0]
    assert (problem.code, problem.where) == (code, where)
    assert message in problem.message
