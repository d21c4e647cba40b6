"""benchmarks/peers sees what it times; no test asserts its times."""

from __future__ import annotations

import asyncio
import doctest
import json
import math
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pytest
from benchmarks import measuring
from benchmarks.measuring import CallFigures
from benchmarks.peers import __main__ as command
from benchmarks.peers import calls, presence
from benchmarks.peers.ground import LOOPBACK, Ground, ground
from benchmarks.peers.presence import DEPARTURE, KINDS, Sample
from benchmarks.peers.report import Results, as_json, as_markdown

Where = Callable[[], AbstractContextManager[Ground]]
FIGURES = CallFigures(120.0, 300.0, 150.0, 9000.0, 70.0)


def results(departure_s: float) -> Results:
    """Of a run on loopback, whose departures took so long."""
    present = {kind: [Sample(0.02, starting_s=0.01)] * 3 for kind in KINDS if not kind.needs_cables}
    present[DEPARTURE] = [Sample(0.02, "departed"), *[Sample(departure_s, "departed")] * 2]
    called = {way: [FIGURES] * 3 for way in calls.ways()}
    return Results(3, 100, 0.5, LOOPBACK, present, called)


def row_of(text: str, name: str) -> str:
    (row,) = (line for line in text.splitlines() if line.startswith(f"| {name} |"))
    return row


def test_every_aim_is_judged_repeat_by_repeat() -> None:
    text = as_markdown(results(0.3))
    assert "| 300 (20-300) | 50 | 1 of 3 | departed |" in row_of(text, DEPARTURE.name)
    assert "| 20 (20-20) | 1,500 | 3 of 3 |" in row_of(text, "death: kill -9")
    assert "Departures are late" in text
    assert "**MISSED** with 120 (120-120), within it in 0 of 3" in text
    assert "Departures are late" not in as_markdown(results(0.02))


def test_ratios_are_formed_repeat_by_repeat() -> None:
    assert doctest.testmod(measuring).failed == 0


def test_what_is_not_measured_is_named() -> None:
    text = " ".join(as_markdown(results(0.3)).split())
    assert "Not measured, since network namespaces need root: death: the cable is pulled." in text


def test_what_did_not_come_about_is_null_in_json() -> None:
    departures = json.loads(as_json(results(math.inf)))["presence"][DEPARTURE.name]
    assert [one["took_s"] for one in departures] == [0.02, None, None]


def test_every_way_to_call_is_answered() -> None:
    found = asyncio.run(calls.measure(1, 20))
    assert found.keys() == calls.ways().keys()
    for (one,) in found.values():
        assert 0 < one.median_us <= one.p99_us
        assert one.burst_calls > 0


def test_the_page_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page.md"
    options = ["--part", "calls", "--repeats", "1", "--calls", "10", "--out", str(page)]
    monkeypatch.setattr(sys, "argv", ["peers", *options])
    command.main()
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# Hosts that find, lose and call each other")
    assert "## Presence" not in text
    for way in calls.ways():
        assert row_of(text, way).count("|") == 7


@pytest.mark.daemon
@pytest.mark.parametrize(
    "where",
    [
        pytest.param(ground, id="best"),
        pytest.param(lambda: nullcontext(LOOPBACK), id="loopback", marks=pytest.mark.long("peers")),
    ],
)
def test_hosts_are_seen_to_come_and_go(where: Where) -> None:
    with where() as here:
        found = presence.measure(here, 1)
    told = {
        kind.name: [(one.told, math.isfinite(one.took_s)) for one in samples]
        for kind, samples in found.items()
    }
    expected = {
        "found: two that start at once": [("", True)] * 10,
        "found: a third that starts beside two": [("", True)],
        "departure: SIGTERM": [("departed", True)],
        "death: kill -9": [("disconnected", True)],
        "death: SIGSTOP": [("silent", True)],
        "death: the loop hangs": [("silent", True)],
    }
    if here.machines:
        expected["death: the cable is pulled"] = [("silent", True)]
    assert told == expected
