"""The wall clock jumps by years under a running host: nothing is decided by it."""

from __future__ import annotations

import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from demo.robot import View
from tests.kit.beacon import BEACON
from tests.kit.payloads import Part
from tests.kit.running_host import COMMAND, Row, RunningHost, running
from tests.kit.until import until

pytestmark = pytest.mark.daemon

LIBRARIES = ("libfaketimeMT.so.1", "libfaketime.so.1")
JUMPS = ("-10y", "+10y")
TORCH = BEACON.replace("beacon", "torch")


def library() -> Path:
    """Of Debian's package libfaketime."""
    found = [path for name in LIBRARIES for path in Path("/usr/lib").glob(f"*/faketime/{name}")]
    if not found:
        pytest.skip("libfaketime is not installed")
    return found[0]


@pytest.fixture
def clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A file: what is written to it (`+10y`) is added to the wall clock of all processes that are
    started; clocks that do not jump are left alone."""
    file = tmp_path / "clock"
    file.write_text("+0")
    monkeypatch.setenv("LD_PRELOAD", str(library()))
    monkeypatch.setenv("FAKETIME_TIMESTAMP_FILE", str(file))
    monkeypatch.setenv("FAKETIME_NO_CACHE", "1")
    monkeypatch.setenv("FAKETIME_DONT_FAKE_MONOTONIC", "1")
    monkeypatch.setenv("FAKETIME_DONT_RESET", "1")
    yield file


def year(host: RunningHost) -> int:
    """What year it is for the daemon, by the last entry of its journal."""
    with closing(sqlite3.connect(host.state / "catalogue.sqlite")) as connection:
        query = "SELECT strftime('%Y', wall_s, 'unixepoch') FROM journal ORDER BY id DESC LIMIT 1"
        (found,) = connection.execute(query).fetchone()
    return int(found)


def test_clock_that_jumps_changes_nothing(tmp_path: Path, clock: Path) -> None:
    def kept(view: View) -> View | None:
        return view if any(goal["holds"] for goal in view["goals"]) else None

    # One that is forked would not have its dynamic linker see the shim.
    with running(tmp_path / "host", program=COMMAND) as host:
        host.bring("beacon", Part("beacon", BEACON))
        host.run("goal", "shine").ok()
        host.until("the goal holds", kept)
        began = year(host)
        for jump in JUMPS:
            clock.write_text(jump)
            drive = host.bring("torch", Part("torch", TORCH))
            assert abs(year(host) - began) >= 9, "the clock did jump"
            host.pull("torch")
            host.until("the torch is gone", lambda view: len(view["payloads"]) == 1)
            drive.rename(tmp_path / f"old{jump}")
            view = host.until("the goal holds", kept)
            assert [row["state"] for row in view["payloads"]] == ["active"]
        told = host.run("journal", "--json").ok().json
    assert not [entry for entry in told if entry["event"] in ("WorkerExited", "WorkerFailed")]


def test_status_says_that_the_clock_is_wrong_until_it_is_set(tmp_path: Path, clock: Path) -> None:
    def told(view: View) -> bool:
        return any("CLOCK_UNSURE" in warning for warning in view["warnings"])

    clock.write_text("-20y")
    with running(tmp_path / "host", program=COMMAND) as host:
        host.until("the clock is doubted", lambda view: view if told(view) else None)
        host.until_told("CLOCK_UNSURE")
        clock.write_text("+0")
        host.until("the clock is believed", lambda view: None if told(view) else view)

        def journal() -> list[Row]:
            entries = host.run("journal", "--json").ok().json
            clocks = [entry for entry in entries if entry["event"].startswith("Clock")]
            return clocks if clocks and clocks[-1]["event"] == "ClockRight" else []

        doubted, _ = until("it is in the journal", journal)
    assert [problem["code"] for problem in doubted["problems"]] == ["CLOCK_UNSURE"]


def test_shim_is_what_it_is_taken_for(clock: Path) -> None:
    """That the test above could fail."""
    years = []
    for jump in ("+10y", "+0"):
        clock.write_text(jump)
        told = subprocess.run(["date", "+%Y"], capture_output=True, text=True, check=True).stdout
        years.append(int(told))
    assert years[0] - years[1] in (9, 10)
