"""What the helper's parser of requests accepts, and that it refuses all else."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, get_args

import msgpack
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
PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text()
    | st.binary(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


def packet(verb: object, body: object, *, kind: object = 2, call: object = 1) -> bytes:
    """What may be a request, packed without a look at it."""
    data: bytes = msgpack.packb([kind, call, verb, body])
    return data


def body_of(request: Request) -> dict[str, Any]:
    return dict(msgpack.unpackb(encode(request))[3])


@given(REQUESTS)
def test_requests_come_as_they_went(request: Request) -> None:
    data = encode(request)
    assert len(data) <= MAX_BYTES
    assert parse(data) == request


@given(st.binary(max_size=2 * MAX_BYTES) | PLAIN.map(msgpack.packb))
def test_whatever_comes_is_a_request_or_refused(data: bytes) -> None:
    try:
        parse(data)
    except NondumError as error:
        assert error.code == "HELPER_REFUSED"


@given(REQUESTS, st.data())
def test_no_field_takes_another_kind_of_value(request: Request, data: st.DataObject) -> None:
    body = {"verb": type(request).__name__, **body_of(request)}
    name = data.draw(st.sampled_from(sorted(body)))
    body[name] = data.draw(PLAIN | st.text(alphabet="./\\\0-\n", min_size=1))
    try:
        parsed = parse(packet(body.pop("verb"), body))
    except NondumError as error:
        assert error.code == "HELPER_REFUSED"
        return
    for field in fields(parsed):
        value = getattr(parsed, field.name)
        assert not isinstance(value, str) or not {*"/\\\0\n"} & set(value)
        assert value not in (".", "..")


@pytest.mark.parametrize(
    ("request_", "verb", "body"),
    [
        (
            *(Mount("sdb1", None, "", "read"), "Mount"),
            {"device": "sdb1", "diskseq": None, "filesystem": "", "use": "read"},
        ),
        (
            *(PutNode("a", "x", 1, 2, 3), "PutNode"),
            {"component": "a", "need": "x", "major": 1, "minor": 2, "user": 3},
        ),
        (requests.ShowLamps(State.READY), "ShowLamps", {"state": "ready"}),
        (
            *(LimitCgroup("a.1", 1, 2, 3, 0.5), "LimitCgroup"),
            {"cgroup": "a.1", "memory_mb": 1, "tasks": 2, "cpu_weight": 3, "processors": 0.5},
        ),
        (requests.EndLamps(), "EndLamps", {}),
    ],
    ids=str,
)
def test_request_has_its_kind_as_verb_and_its_fields_as_body(
    request_: Request, verb: str, body: dict[str, Any]
) -> None:
    assert encode(request_) == packet(verb, body)
    assert parse(packet(verb, body)) == request_


@pytest.mark.parametrize("component", ["", "a"])
def test_only_clearing_nodes_may_mean_all_components(component: str) -> None:
    assert parse(encode(requests.ClearNodes(component))) == requests.ClearNodes(component)
    if not component:
        assert_refused(packet("PutNode", {**body_of(NODE), "component": component}))


MOUNT = Mount("sdb1", 1, "vfat", "read")
UNMOUNT = Unmount("sdb1-1", "read")
NODE = PutNode("a", "x", 1, 1, None)
FILL = FillCgroup("a.1", 1)
LIMIT = LimitCgroup("a.1", 1, 1, 1, 0.0)


@pytest.mark.parametrize(
    ("whole", "but"),
    [
        (MOUNT, {"device": "../sda"}),
        (MOUNT, {"diskseq": True}),
        (MOUNT, {"use": "boot"}),
        (UNMOUNT, {"drive": ".."}),
        (UNMOUNT, {"path": "/"}),
        (UNMOUNT, {"drive": b"sdb1-1"}),
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
        (LIMIT, {"processors": 2**64 - 1}),
    ],
    ids=str,
)
def test_what_is_nearly_a_request_is_refused(whole: Request, but: dict[str, Any]) -> None:
    assert parse(encode(whole)) == whole
    assert_refused(packet(type(whole).__name__, {**body_of(whole), **but}))


@pytest.mark.parametrize("field", [field.name for field in fields(Mount)])
def test_request_without_one_of_its_fields_is_refused(field: str) -> None:
    body = body_of(MOUNT)
    del body[field]
    assert_refused(packet("Mount", body))


def assert_refused(data: bytes) -> None:
    with pytest.raises(NondumError) as refused:
        parse(data)
    assert refused.value.code == "HELPER_REFUSED"
    assert refused.value.problems[0].fix


TWICE = b"\x94\x02\x01\xa7Unmount\x82" + 2 * b"\xa5drive\xa6sdb1-1"


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(encode(requests.UnmountAll()) + b" " * MAX_BYTES, id="too long"),
        pytest.param(encode(MOUNT)[:-1], id="cut off"),
        pytest.param(encode(MOUNT) * 2, id="two"),
        pytest.param(b"\x91" * (MAX_BYTES - 1), id="too deep"),
        pytest.param(TWICE, id="a key twice"),
        pytest.param(msgpack.packb({"verb": "UnmountAll"}), id="a table"),
        pytest.param(packet("UnmountAll", {}, kind=5), id="another kind"),
        pytest.param(msgpack.packb([6, 1]), id="a cancellation"),
        pytest.param(packet("UnmountAll", {}, call=2), id="a second request"),
        pytest.param(packet("UnmountAll", []), id="a list"),
        pytest.param(packet(1, {}), id="no word"),
        pytest.param(packet("unmountall", {}), id="no verb"),
        pytest.param(packet("Request", {}), id="no verb of the helper"),
        pytest.param(packet("FillCgroup", {"cgroup": "a.1", "pid": 2**63}), id="huge"),
    ],
)
def test_packets_that_hold_no_request_are_refused(data: bytes) -> None:
    assert parse(encode(requests.UnmountAll())) == requests.UnmountAll()
    assert_refused(data)
