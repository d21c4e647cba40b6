"""The captured descriptions: what is no index is refused."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import pytest

from nondum.sdk.description import (
    Behaviour,
    Condition,
    DeviceNeed,
    Fragment,
    Input,
    Label,
    Output,
    Phrase,
    PluginDescription,
    Unit,
)
from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.format import index

PLAIN = b'{"format": 1, "components": {}}'

FIRST_KEYS = {
    "PluginDescription": {
        *("name", "version", "summary", "behaviours", "conditions", "fragments", "units"),
        *("devices", "phrases", "labels"),
    },
    "behaviours": {"name", "action", "lasting", "phrases", "doc", "when_lost"},
    "conditions": {"name", "predicates", "doc"},
    "fragments": {"name", "text"},
    "units": {"name", "type", "outputs", "inputs", "users"},
    "outputs": {"name", "type", "always"},
    "inputs": {"name", "type"},
    "devices": {"name", "match", "optional"},
    "phrases": {"pattern", "goal", "kind"},
    "labels": {"object", "words"},
}
"""What the first hosts know of a description; they refuse one that has another key."""

CAMERA = PluginDescription(
    name="camera",
    version="1.0",
    behaviours=(Behaviour("show", "(show ?c - camera)"),),
    conditions=(Condition("seen", ("seen",)),),
    fragments=(Fragment("domain.pddl", "(define (domain camera))"),),
    units=(Unit("eye", "camera", (Output("image", "image"),), (Input("odometry", "pose"),)),),
    devices=(DeviceNeed("line", {"subsystem": "tty"}),),
    phrases=(Phrase("show me", "(shown self)"),),
    labels=(Label("eye", "the eye"),),
)


@pytest.mark.parametrize(
    ("data", "code"),
    [
        pytest.param(PLAIN + b" " * index.MAX_BYTES, "TOO_LARGE", id="too long"),
        pytest.param(b"{", "INDEX_INVALID", id="no JSON"),
        pytest.param(b"[" * 100_000, "INDEX_INVALID", id="too deep"),
        pytest.param(b"[]", "INDEX_INVALID", id="a list"),
        pytest.param(PLAIN.replace(b"1", b"2"), "INDEX_INVALID", id="another format"),
        pytest.param(PLAIN.replace(b"{}", b"[]"), "INDEX_INVALID", id="no table"),
        pytest.param(
            PLAIN.replace(b"{}", b'{"\\ud83e": {}}'), "INDEX_INVALID", id="unpaired surrogate"
        ),
        pytest.param(PLAIN.replace(b"{}", b'{"a": 1}'), "DESCRIPTION_INVALID", id="no description"),
    ],
)
def test_what_is_no_index_is_refused(data: bytes, code: str) -> None:
    assert index.parse(PLAIN, "index.json") == {}
    with pytest.raises(PayloadRefused) as refused:
        index.parse(data, "index.json")
    assert refused.value.code == code


def test_half_a_letter_is_told() -> None:
    with pytest.raises(PayloadRefused) as refused:
        index.parse(PLAIN.replace(b"{}", b'{"\\ud800": {}}'), "index.json")
    assert "unpaired surrogate" in refused.value.problems[0].message


def test_what_uses_nothing_new_has_only_the_first_keys() -> None:
    written = json.loads(index.to_bytes({"camera": CAMERA}))["components"]["camera"]
    assert set(tables(written)) == set(FIRST_KEYS)
    for name, keys in tables(written).items():
        assert keys == FIRST_KEYS[name], name


def test_what_is_said_in_a_new_key_is_written() -> None:
    odometry = Input("odometry", "pose", of="base")
    seeing = Unit("eye", "camera", (Output("pose", "pose", of="base"),), (odometry,))
    camera = dataclasses.replace(CAMERA, units=(seeing,))
    (unit,) = json.loads(index.to_bytes({"c": camera}))["components"]["c"]["units"]
    assert (unit["inputs"][0]["of"], unit["outputs"][0]["of"]) == ("base", "base")
    assert index.parse(index.to_bytes({"c": camera}), "index.json") == {"c": camera}


def tables(said: dict[str, Any], name: str = "PluginDescription") -> dict[str, set[str]]:
    """The keys of each kind of table in what is written; of a list, its first."""
    found = {name: set(said)}
    for key, value in said.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            found |= tables(value[0], key)
    return found
