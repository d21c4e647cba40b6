"""What the helper's parser of requests accepts, and that it refuses all else."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.core.feedback_state import State
from nondum.host.sandbox.cgroups.limits import NAME
from nondum.host.sandbox.helper import requests
from nondum.host.sandbox.helper.requests import (
    MAX_BYTES,
    FillCgroup,
    LimitCgroup,
    MapUsers,
    Mount,
    PutNode,
    Request,
    Unmount,
    encode,
    parse,
)
from nondum.sdk.errors import NondumError

NUMBERS = st.integers(0, 2**63 - 1)
DRIVES = st.from_regex(requests.DRIVE, fullmatch=True)
WORDS: dict[str, st.SearchStrategy[Any]] = {
    "device": st.from_regex(requests.DEVICE, fullmatch=True),
    "diskseq": st.none() | NUMBERS,
    "filesystem": st.from_regex(requests.FILESYSTEM, fullmatch=True),
    "state": st.sampled_from(State),
    "use": st.sampled_from(["read", "handover"]),
    "drive": DRIVES,
    "component": st.from_regex(requests.COMPONENT, fullmatch=True),
    "need": st.from_regex(requests.NEED, fullmatch=True),
    "cgroup": st.from_regex(NAME, fullmatch=True),
    "memory_mb": st.integers(1, 2**30),
    "tasks": st.integers(1, 2**22),
    "cpu_weight": st.integers(1, 10_000),
    "processors": st.floats(0, 10_000),
    "pid": st.integers(0, 2**31 - 1),
}
REQUESTS: st.SearchStrategy[Request] = st.sampled_from(get_args(Request)).flatmap(
    lambda kind: st.builds(kind, **{f.name: WORDS.get(f.name, NUMBERS) for f in fields(kind)})
)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@given(REQUESTS)
def test_requests_come_as_they_went(request: Request) -> None:
    data = encode(request)
    assert len(data) <= MAX_BYTES
    assert parse(data) == request


@given(st.binary(max_size=2 * MAX_BYTES) | JSON.map(lambda value: json.dumps(value).encode()))
def test_whatever_comes_is_a_request_or_refused(data: bytes) -> None:
    try:
        parse(data)
    except NondumError as error:
        assert error.code == "HELPER_REFUSED"


@given(REQUESTS, st.data())
def test_no_field_takes_another_kind_of_value(request: Request, data: st.DataObject) -> None:
    body = json.loads(encode(request))
    name = data.draw(st.sampled_from(sorted(body)))
    body[name] = data.draw(JSON | st.text(alphabet="./\\\0-\n", min_size=1))
    try:
        parsed = parse(json.dumps(body).encode())
    except NondumError as error:
        assert error.code == "HELPER_REFUSED"
        return
    for field in fields(parsed):
        value = getattr(parsed, field.name)
        assert not isinstance(value, str) or not {*"/\\\0\n"} & set(value)
        assert value not in (".", "..")


@pytest.mark.parametrize(
    ("request_", "packet"),
    [
        (
            Mount("sdb1", None, "", "read"),
            b'{"verb":"Mount","device":"sdb1","diskseq":null,"filesystem":"","use":"read"}',
        ),
        (
            PutNode("a", "x", 1, 2, 3),
            b'{"verb":"PutNode","component":"a","need":"x","major":1,"minor":2,"user":3}',
        ),
        (requests.ShowLamps(State.READY), b'{"verb":"ShowLamps","state":"ready"}'),
        (
            LimitCgroup("a.1", 1, 2, 3, 0.5),
            b'{"verb":"LimitCgroup","cgroup":"a.1","memory_mb":1,"tasks":2,"cpu_weight":3,'
            b'"processors":0.5}',
        ),
        (requests.EndLamps(), b'{"verb":"EndLamps"}'),
    ],
    ids=str,
)
def test_request_is_a_table_of_its_verb_and_its_fields(request_: Request, packet: bytes) -> None:
    assert encode(request_) == packet
    assert parse(packet) == request_


@pytest.mark.parametrize("component", ["", "a"])
def test_only_clearing_nodes_may_mean_all_components(component: str) -> None:
    assert parse(encode(requests.ClearNodes(component))) == requests.ClearNodes(component)
    body = json.loads(encode(NODE))
    if not component:
        assert_refused({**body, "component": component})


MOUNT = Mount("sdb1", 1, "vfat", "read")
UNMOUNT = Unmount("sdb1-1", "read")
NODE = PutNode("a", "x", 1, 1, None)
FILL = FillCgroup("a.1", 1)
LIMIT = LimitCgroup("a.1", 1, 1, 1, 0.0)


@pytest.mark.parametrize(
    ("whole", "but"),
    [
        (MOUNT, {"verb": "mount"}),
        (MOUNT, {"verb": "Request"}),
        (MOUNT, {"device": "../sda"}),
        (MOUNT, {"diskseq": True}),
        (MOUNT, {"use": "boot"}),
        (UNMOUNT, {"drive": ".."}),
        (UNMOUNT, {"path": "/"}),
        (NODE, {"component": "a/b"}),
        (NODE, {"need": ".."}),
        (NODE, {"major": -1}),
        (NODE, {"user": "0"}),
        (FILL, {"cgroup": "../x.1"}),
        (FILL, {"pid": 1.0}),
        (FILL, {"pid": 2**31}),
        (MapUsers(1), {"pid": 2**31}),
        (LIMIT, {"memory_mb": 0}),
        (LIMIT, {"processors": float("nan")}),
        pytest.param(LIMIT, {"processors": 10**400}, id="more than a float holds"),
    ],
    ids=str,
)
def test_what_is_nearly_a_request_is_refused(whole: Request, but: dict[str, Any]) -> None:
    assert parse(encode(whole)) == whole
    assert_refused({**json.loads(encode(whole)), **but})


@pytest.mark.parametrize("field", ["verb", *(field.name for field in fields(Mount))])
def test_request_without_one_of_its_fields_is_refused(field: str) -> None:
    body = json.loads(encode(MOUNT))
    del body[field]
    assert_refused(body)


def assert_refused(body: dict[str, Any]) -> None:
    with pytest.raises(NondumError) as refused:
        parse(json.dumps(body).encode())
    assert refused.value.code == "HELPER_REFUSED"
    assert refused.value.problems[0].fix


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(encode(requests.UnmountAll()) + b" " * MAX_BYTES, id="too long"),
        pytest.param(b"{", id="cut off"),
        pytest.param(b"[" * (MAX_BYTES - 1), id="too deep"),
        pytest.param(b"[]", id="a list"),
        pytest.param(b'{"verb": 1}', id="no word"),
        pytest.param(
            b'{"verb": "FillCgroup", "cgroup": "a.1", "pid": 9223372036854775808}', id="huge"
        ),
    ],
)
def test_packets_that_hold_no_request_are_refused(data: bytes) -> None:
    assert parse(encode(requests.UnmountAll())) == requests.UnmountAll()
    with pytest.raises(NondumError) as refused:
        parse(data)
    assert refused.value.code == "HELPER_REFUSED"
