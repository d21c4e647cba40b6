"""The arithmetic, the tables and the key of benchmarks/stop; no test asserts its times."""

from __future__ import annotations

import doctest
import os
from typing import Any

import pytest
from benchmarks.stop import acting, report
from benchmarks.stop.results import Hearing, Results, Spoken, Stop, Way

from nondum.host.config.stop_keys import code_of
from nondum.host.sandbox.helper.stop_key import PressesOfDevice

SINCE_S = 100.0
ACTIONS = ("detect eye", "drive base")


def halted(at_s: float, *actions: str, lost: tuple[str, ...] = ()) -> dict[str, Any]:
    down = {"halted": dict.fromkeys(actions, "stopped"), "lost": dict.fromkeys(lost, "ended")}
    return {"event": "BehavioursHalted", "subject": "", "monotonic": at_s, "detail": down}


def ended(at_s: float, component: str) -> dict[str, Any]:
    detail = {"outcome": "HALTED"}
    return {
        "event": "BehaviourEnded",
        "subject": component,
        "monotonic": at_s,
        "detail": detail,
    }


BOTH_ENDED = [ended(100.3, "base"), ended(100.5, "eye")]


def test_examples_are_true() -> None:
    assert doctest.testmod(report).failed == 0


@pytest.mark.parametrize(
    ("journal", "asked_s"),
    [
        ([halted(100.1, *ACTIONS)], 0.1),
        ([halted(100.1, ACTIONS[0]), halted(100.2, ACTIONS[1])], 0.2),
        ([halted(100.1, ACTIONS[0], lost=(ACTIONS[1],))], 0.1),
    ],
    ids=["at once", "one by one", "ended before"],
)
def test_stop_is_over_when_the_last_behaviour_was_asked(
    journal: list[dict[str, Any]], asked_s: float
) -> None:
    stop = Stop.of([*journal, *BOTH_ENDED], ACTIONS, SINCE_S)
    assert stop.asked_s == pytest.approx(asked_s)
    assert stop.ended_s == pytest.approx(0.5)


@pytest.mark.parametrize(
    "journal",
    [[], [halted(100.1, ACTIONS[0]), *BOTH_ENDED], [halted(100.1, *ACTIONS), BOTH_ENDED[0]]],
    ids=["nothing", "one was not asked", "one has not ended"],
)
def test_stop_that_left_something_running_is_none(journal: list[dict[str, Any]]) -> None:
    with pytest.raises(ValueError, match="went down"):
        Stop.of(journal, ACTIONS, SINCE_S)


def said(text: str, heard: str | None, *, stops: bool, after_s: float | None = None) -> Spoken:
    return Spoken(text, "en", heard, stops, after_s)


def test_recognised_words_are_missed_mistaken_or_false() -> None:
    stops = (
        said("stop", "stop", stops=True, after_s=0.7),
        said("halt", "halt", stops=True, after_s=1.2),
        said("whoa", None, stops=False),
        said("freeze", "follow me", stops=False),
    )
    others = (said("shop", "stop", stops=True), said("hello", None, stops=False))
    hearing = Hearing("quiet", stops, others)
    assert [one.text for one in hearing.understood] == ["stop", "halt"]
    assert [one.text for one in hearing.mistaken] == ["freeze"]
    assert [one.text for one in hearing.false] == ["shop"]
    text = report.as_markdown(Results(1, (False,), hearings=(hearing,)))
    (row,) = (line for line in text.splitlines() if line.startswith("| quiet"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[1:4] == ["50.0 % of 4", "25.0 % of 4", "25.0 % of 4"]
    assert cells[-2:] == ["50.0 % of 2", "50.0 % of 2"]
    assert "| freeze | follow me | 1 |" in text
    assert "| shop | stop | 1 |" in text
    assert "0 of 1 parts began on a calm machine" in text


def test_ways_to_stop_are_held_against_the_aim() -> None:
    way = Way("here", "stop key", (Stop(0.05, 0.1), Stop(0.2, 0.3)), missed=1)
    text = report.as_markdown(Results(3, (True,), (way,)))
    (row,) = (line for line in text.splitlines() if line.startswith("| here"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[2:] == [
        *("2", "1", "200 ms", "200 ms", "200 ms", "50.0 % of 2", "300 ms", "300 ms"),
    ]


def test_key_is_pressed_as_a_keyboard_would() -> None:
    reading, writing = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    presses = PressesOfDevice(reading, code_of(acting.KEY) or 0)
    acting.press(writing)
    assert presses.read() == 1
    assert presses.read() == 0
    presses.close()
    os.close(writing)
