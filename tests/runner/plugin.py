"""pytest's part of the runner: which tests a run has, and what it writes down about each.

Two markers keep campaigns apart from the full run (tests/campaign):

- `long(campaign)`: runs only with `--campaign NAME`,
- `short(campaign)`: the short form of a campaign; left out with `--current NAME`, which says that
  nothing which the campaign covers has changed since it last passed.
"""

from __future__ import annotations

import json
from collections.abc import Generator, Iterable
from pathlib import Path
from typing import Any, TextIO

import pytest
from tests.runner import budget
from tests.runner.result import Result


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("nondum", "nondum: campaigns and results")
    group.addoption("--campaign", metavar="NAME", help="run the tests of this campaign only")
    group.addoption("--current", default="", metavar="NAME,…", help="leave out their short forms")
    group.addoption("--seed", type=int, default=1, help="of tests that draw lots (%(default)s)")
    group.addoption("--results", metavar="FILE", help="write a line of JSON for each test")


def pytest_configure(config: pytest.Config) -> None:
    file = config.getoption("--results")
    if file and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Results(Path(file)), "nondum-results")


@pytest.fixture(scope="session")
def seed(request: pytest.FixtureRequest) -> int:
    """For all that a test draws by lot: the same in each full run, another in a campaign."""
    number: int = request.config.getoption("--seed")
    return number


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    campaign = config.getoption("--campaign")
    current = frozenset(config.getoption("--current").split(","))

    def runs(item: pytest.Item) -> bool:
        long, short = _campaigns(item, "long"), _campaigns(item, "short")
        if campaign:
            return campaign in long | short
        return not long and not (short and short <= current)

    slow = budget.read().slow_files
    items.sort(key=lambda item: -slow.get(item.nodeid.split("::", 1)[0], 0.0))
    left_out = [item for item in items if not runs(item)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if runs(item)]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A test that failed says where its folder is; pytest keeps that of no other."""
    report = yield
    folder = getattr(item, "funcargs", {}).get("tmp_path")
    if report.failed and folder is not None:
        report.user_properties.append(("folder", str(folder)))
    return report


def _campaigns(item: pytest.Item, marker: str) -> frozenset[str]:
    return frozenset(mark.args[0] for mark in item.iter_markers(marker))


class _Results:
    """Writes one `Result` for each test, once it is over."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._open: dict[str, list[pytest.TestReport]] = {}
        self._lines: TextIO | None = None

    def pytest_sessionstart(self) -> None:
        self._lines = self._file.open("w", encoding="utf-8", buffering=1)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._open.setdefault(report.nodeid, []).append(report)
        if report.when not in ("setup", "call"):
            self._write(report.nodeid, self._open.pop(report.nodeid))

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self._write(report.nodeid, [report])

    def pytest_sessionfinish(self) -> None:
        for test, reports in self._open.items():  # those in which a worker of pytest-xdist died
            self._write(test, reports)
        if self._lines is not None:
            self._lines.close()

    def _write(
        self, test: str, reports: Iterable[pytest.TestReport | pytest.CollectReport]
    ) -> None:
        assert self._lines is not None
        self._lines.write(json.dumps(_result(test, list(reports)).to_dict()) + "\n")


def _result(test: str, reports: list[Any]) -> Result:
    failed = next((r for r in reports if r.failed), None)
    skipped = next((r for r in reports if r.skipped), None)
    told = dict(getattr(failed, "user_properties", ()))
    return Result(
        test=test,
        outcome="failed" if failed else "skipped" if skipped else "passed",
        seconds=round(sum(getattr(r, "duration", 0.0) for r in reports), 3),
        folder=told.get("folder", ""),
        reason=_reason(skipped) if skipped and not failed else "",
        message=failed.longreprtext if failed else "",
    )


def _reason(report: Any) -> str:
    """Why a test was skipped."""
    if isinstance(report.longrepr, tuple):
        return str(report.longrepr[2]).removeprefix("Skipped: ")
    return str(report.longrepr)
