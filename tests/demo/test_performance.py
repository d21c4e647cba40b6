"""A demonstration's exit status: 0 only if every stage was there, and reached."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from demo.live import Says
from demo.performance import Programme, perform
from demo.robot import TooLate
from demo.table import StageResult

PROGRAMME = Programme(("one", "two"), ("found",), "seconds of nothing")
Play = Callable[[Path, Says], Iterator[StageResult]]


def stage(name: str, *, reached: bool = True) -> StageResult:
    return StageResult(name, "a goal", {"found": 1.5}, 442, reached=reached, measure="measured")


def playing(*results: StageResult, late: bool = False) -> Play:
    def play(work: Path, say: Says) -> Iterator[StageResult]:
        (work / "trace").touch()
        yield from results
        if late:
            raise TooLate("nothing came")

    return play


def performed(play: Play, *, as_json: bool = True) -> int:
    options = argparse.Namespace(json=as_json, plain=True, keep=False)
    return perform(PROGRAMME, play, options, {"seed": 7})


def test_all_stages_reached_is_success(capsys: pytest.CaptureFixture[str]) -> None:
    assert performed(playing(stage("one"), stage("two"))) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["seed"], document["reached"]) == (7, True)
    assert [found["name"] for found in document["stages"]] == ["one", "two"]


@pytest.mark.parametrize(
    "play",
    [
        playing(),
        playing(stage("one")),
        playing(stage("two"), stage("one")),
        playing(stage("one"), stage("two", reached=False)),
        playing(stage("one"), stage("two"), late=True),
        playing(stage("one"), late=True),
    ],
    ids=["nothing", "one missing", "wrong order", "not reached", "late in the end", "late"],
)
def test_anything_less_is_failure(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    assert performed(play) == 1
    assert json.loads(capsys.readouterr().out)["reached"] is False


def test_table_has_the_programmes_columns(capsys: pytest.CaptureFixture[str]) -> None:
    performed(playing(stage("one"), stage("two", reached=False)), as_json=False)
    head, _, one, two, *_ = capsys.readouterr().out.splitlines()
    assert head.split() == ["stage", "found", "published", "reached"]
    assert one.split() == ["one", "1.50", "s", "442", "s", "*", "yes"]
    assert two.endswith("NO")
