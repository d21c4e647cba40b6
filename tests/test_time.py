"""Tests wait for events, not for time, and judge by them: on a slow machine, too.

Real time is left to benchmarks/, to the two demonstrations, and to what `real_time.toml` lists.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.real_time import CLOCK_ASSERTED, findings

ROOT = Path(__file__).parent.parent
EXCEPTIONS = ROOT / "tests/real_time.toml"
NOT_OURS = {"data", "template", "__pycache__"}


def modules() -> Iterator[Path]:
    """All that tests are made of."""
    for folder in (ROOT / "tests", *ROOT.glob("plugins/*/tests")):
        yield from (path for path in folder.rglob("*.py") if not NOT_OURS & set(path.parts))


def found() -> dict[tuple[str, str], list[int]]:
    """Lines that wait or judge, by function and by what they do."""
    places: dict[tuple[str, str], list[int]] = {}
    for path in modules():
        for one in findings(path.read_text(encoding="utf-8")):
            where = f"{path.relative_to(ROOT)}::{one.where}"
            places.setdefault((where, one.what), []).append(one.line)
    return places


def excepted() -> dict[tuple[str, str], str]:
    """The reason of each exception."""
    listed = tomllib.loads(EXCEPTIONS.read_text(encoding="utf-8"))["exception"]
    return {(where, one["what"]): one["reason"] for one in listed for where in one["where"]}


def test_nothing_waits_for_real_time_or_judges_by_it() -> None:
    unlisted = {place: lines for place, lines in found().items() if place not in excepted()}
    assert not unlisted, f"await an event, or take the fixture `clock`: {unlisted}"


def test_exceptions_are_in_use_and_have_a_reason() -> None:
    unused = excepted().keys() - found().keys()
    assert not unused, f"take it off {EXCEPTIONS.name}: {unused}"
    assert all(len(reason) > 20 for reason in excepted().values())


WAITS = {
    "plain": "import time\ntime.sleep(0.1)",
    "by name": "from time import sleep\nsleep(0.1)",
    "renamed": "import time as t\nt.sleep(0.1)",
    "in a thread": "import asyncio, time\nasyncio.to_thread(time.sleep, 1)",
    "in virtual time, which it does not know": "import time\ndef test(clock): time.sleep(1)",
}
AWAITS = {
    "plain": "import asyncio\nasync def test(): await asyncio.sleep(0.1)",
    "by name": "from asyncio import sleep\nasync def test(): await sleep(0.1)",
    "a variable": "import asyncio\nasync def test(a): await asyncio.sleep(a)",
    "anyio's": "import anyio\nasync def test(): await anyio.sleep(1)",
}
JUDGES = {
    "at once": "import time\nbegun = time.monotonic()\nassert time.monotonic() - begun < 1",
    "with a margin": "import time\ndef test(said): assert said < time.time() + 0.5",
    "a name": (
        "import time\ndef test():\n a = time.monotonic()\n"
        " took = time.monotonic() - a\n assert took < 1"
    ),
    "work": "from time import process_time as now\ndef test():\n a = now()\n assert now() - a < 1",
    "nanoseconds": "import time\na = time.perf_counter_ns()\nassert 5 > time.perf_counter_ns() - a",
    "the longest": (
        "import time\ndef test():\n took = []\n a = time.monotonic()\n"
        " took.append(time.monotonic() - a)\n assert max(took) < 1"
    ),
    "each": (
        "import time\ndef test():\n a = time.monotonic()\n took = [time.monotonic() - a]\n"
        " for one in took:\n  assert one < 1"
    ),
    "an attribute": (
        "import time\nclass A:\n def go(self):\n  self.a = time.monotonic()\n"
        " def end(self):\n  assert time.monotonic() - self.a < 1"
    ),
    "a helper": (
        "import time\ndef took(a): return time.monotonic() - a\n"
        "def test():\n assert took(time.monotonic()) < 1"
    ),
    "a loop's": (
        "import asyncio\nasync def test():\n a = asyncio.get_running_loop().time()\n"
        " assert asyncio.get_running_loop().time() - a < 1"
    ),
    "a loop's, by name": (
        "import asyncio\nasync def test():\n loop = asyncio.get_running_loop()\n"
        " a = loop.time()\n assert loop.time() - a < 1"
    ),
    "a real one's beside a virtual one": (
        "import time\ndef test(clock):\n a = time.monotonic()\n assert time.monotonic() - a < 1"
    ),
}
FINE = {
    "a turn of the loop": "import asyncio\nasync def test(): await asyncio.sleep(0)",
    "a virtual wait": "import asyncio\nasync def test(clock): await asyncio.sleep(10)",
    "in a helper of a test in virtual time": (
        "import asyncio\nasync def test(clock):\n async def helper(): await asyncio.sleep(10)"
    ),
    "an order": "import time\ndef test(said):\n a = time.time()\n assert a <= said <= time.time()",
    "a stamp that is given": "import time\ndef test(go):\n go(time.monotonic() + 5)\n assert True",
    "a virtual difference": (
        "import asyncio\nasync def test(clock):\n loop = asyncio.get_running_loop()\n"
        " a = loop.time()\n assert loop.time() - a == 1"
    ),
    "a text": "assert 'import time; time.sleep(1)'",
}


@pytest.mark.parametrize("text", WAITS.values(), ids=WAITS)
def test_sleep_is_found(text: str) -> None:
    assert "time.sleep" in {one.what for one in findings(text)}


@pytest.mark.parametrize("text", AWAITS.values(), ids=AWAITS)
def test_sleep_of_a_task_is_found(text: str) -> None:
    assert [(one.where, one.what) for one in findings(text)] == [("test", "asyncio.sleep")]


@pytest.mark.parametrize("text", JUDGES.values(), ids=JUDGES)
def test_judging_by_a_clock_is_found(text: str) -> None:
    assert [one.what for one in findings(text)] == [CLOCK_ASSERTED]


@pytest.mark.parametrize("text", FINE.values(), ids=FINE)
def test_what_needs_no_time_is_not_found(text: str) -> None:
    assert findings(text) == []
