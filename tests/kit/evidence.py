"""What daemons wrote, shown with the test that failed: a plugin of pytest.

Each failure of a test has a section for every host that ran while the test ran: its folder, and the
end of its log.
"""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from pathlib import Path
from typing import Protocol

import pytest

LONGEST_LOG = 8000
"""Bytes of a log that a message shows."""


class Host(Protocol):
    """What has started a daemon."""

    name: str

    @property
    def log_file(self) -> Path:
        """Where all that its daemons write is kept."""

    @property
    def runs(self) -> bool:
        """Whether one runs."""


_hosts: list[Host] = []
"""Those that run, or have run since the test began."""


def keep(host: Host) -> None:
    """Show what a host writes if the test fails that runs now, and later ones while it runs."""
    if host not in _hosts:
        _hosts.append(host)


def logged(log: Path, start: int = 0) -> str:
    """The end of a log, from a position on, as far as a person reads it."""
    with contextlib.suppress(FileNotFoundError), log.open("rb") as file:
        file.seek(max(start, log.stat().st_size - LONGEST_LOG))
        said = file.read().decode(errors="replace").rstrip()
        return f"{log} ends with:\n{said}" if said else f"{log}: nothing was logged"
    return f"{log} was never made"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed:
        sections = ((f"daemon log of {host.name}", logged(host.log_file)) for host in _hosts)
        report.sections.extend(sections)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol() -> Generator[None, bool | None, bool | None]:
    result = yield
    _hosts[:] = [host for host in _hosts if host.runs]
    return result
