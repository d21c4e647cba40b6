"""What strangers say of their plugins is a description, or is refused with its place."""

from __future__ import annotations

import json
from typing import Any

import pytest

from nondum.sdk.description import DeviceNeed, Output, PluginDescription, Unit
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
    ("data", "place", "words"),
    [
        pytest.param([], "", "expected a table for PluginDescription, found list", id="a list"),
        pytest.param(described(colour="red"), "", "unknown key 'colour'", id="unknown key"),
        pytest.param({"name": "lamp"}, "", "key 'version' is missing", id="missing key"),
        pytest.param(described(name=7), ".name", "expected a text, found int", id="a number"),
        pytest.param(
            described(labels="lamp"), ".labels", "expected a list, found str", id="a text"
        ),
        pytest.param(
            described(labels=["lamp"]), ".labels[0]", "expected a table for Label", id="no label"
        ),
        pytest.param(
            device(match="tty"), ".devices[0].match", "expected a table, found str", id="no match"
        ),
        pytest.param(
            device(match={"a": 1}),
            ".devices[0].match['a']",
            "expected a text, found int",
            id="matched number",
        ),
        pytest.param(
            device(match={1: "a"}),
            ".devices[0].match[1]",
            "expected a text, found int",
            id="numbered match",
        ),
        pytest.param(
            device(optional=1),
            ".devices[0].optional",
            "expected true or false, found int",
            id="almost true",
        ),
    ],
)
def test_what_is_no_description_is_refused(data: object, place: str, words: str) -> None:
    assert PluginDescription.parse(PLAIN, where="index.json lamp").name == "lamp"
    with pytest.raises(WorkerFailed) as refused:
        PluginDescription.parse(data, where="index.json lamp")
    assert refused.value.code == "DESCRIPTION_INVALID"
    problem = refused.value.problems[0]
    assert problem.where == f"index.json lamp{place}"
    assert words in problem.message


def test_keys_that_were_added_are_written_only_where_they_say_something() -> None:
    """Hosts that were released before refuse them."""
    description = PluginDescription(
        "eye",
        "1.0",
        units=(Unit("eye", "camera", (Output("image", "image"), Output("at", "pose", of="base"))),),
        devices=(DeviceNeed("line", {"SUBSYSTEM": "tty"}),),
    )
    written = (
        '{"name": "eye", "version": "1.0", "summary": "", "behaviours": [], "conditions": [],'
        ' "fragments": [], "units": [{"name": "eye", "type": "camera", "outputs": '
        '[{"name": "image", "type": "image", "always": false}, '
        '{"name": "at", "type": "pose", "always": false, "of": "base"}], "inputs": [], "users": 0}]'
        ', "devices": [{"name": "line", "match": {"SUBSYSTEM": "tty"}, "optional": false}],'
        ' "phrases": [], "labels": []}'
    )
    assert json.dumps(description.to_dict()) == written
    assert PluginDescription.parse(json.loads(written), where="") == description
