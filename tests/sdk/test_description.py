"""What strangers say of their plugins is a description, or is refused with its place."""

from __future__ import annotations

from typing import Any

import pytest

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import WorkerFailed

PLAIN: dict[str, Any] = {
    "name": "lamp",
    "version": "1.0",
    "labels": [{"object": "lamp", "words": "the lamp"}],
    "devices": [{"name": "line", "match": {"SUBSYSTEM": "tty"}, "optional": True}],
}


def described(**lies: object) -> object:
    return {**PLAIN, **lies}


def device(**lies: object) -> object:
    return described(devices=[{**PLAIN["devices"][0], **lies}])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        pytest.param([], "expected a table for PluginDescription, found list", id="a list"),
        pytest.param(described(colour="red"), "unknown key 'colour'", id="unknown key"),
        pytest.param({"name": "lamp"}, "key 'version' is missing", id="missing key"),
        pytest.param(described(name=7), "expected str, found int", id="a number"),
        pytest.param(described(labels="lamp"), "expected a list, found str", id="a text"),
        pytest.param(described(labels=["lamp"]), "expected a table for Label", id="no label"),
        pytest.param(device(match="tty"), "expected a table of strings", id="no match"),
        pytest.param(device(match={"a": 1}), "expected a table of strings", id="matched number"),
        pytest.param(device(match={1: "a"}), "expected a table of strings", id="numbered match"),
        pytest.param(device(optional=1), "expected bool, found int", id="almost true"),
    ],
)
def test_what_is_no_description_is_refused(data: object, words: str) -> None:
    assert PluginDescription.parse(PLAIN, where="index.json lamp").name == "lamp"
    with pytest.raises(WorkerFailed) as refused:
        PluginDescription.parse(data, where="index.json lamp")
    assert refused.value.code == "DESCRIPTION_INVALID"
    assert words in refused.value.problems[0].message
