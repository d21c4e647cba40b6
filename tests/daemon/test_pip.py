"""`install.method = "pip"` makes the same robot of the same payload; pip reads both's venvs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.daemon.plugins import scribe, talker
from tests.kit import pip_reader
from tests.kit.running_host import COMMAND, RunningHost, running

pytestmark = pytest.mark.daemon

PIP = '[install]\nmethod = "pip"\n'


def test_pip_makes_the_same_components(tmp_path: Path) -> None:
    with running(tmp_path / "store", program=COMMAND) as host:
        expected = made_of(host)
        assert_read_by_pip(host)
    with running(tmp_path / "pip", more=PIP, program=COMMAND) as host:
        assert made_of(host) == expected
        assert_read_by_pip(host)
        before = len(host.traces().folders)
        assert not host.ask("store")
        host.until_goal(host.want("(written spot)"), "holds")
        for name in ("talk", "write"):
            host.pull(name)
            host.until_gone(name)
        assert before > len(host.traces().folders) == 0


def made_of(host: RunningHost) -> tuple[Any, ...]:
    """Bring two payloads; what the host is then made of, but for processes."""
    host.bring("talk", talker())
    host.bring("write", scribe())
    components = [{**row, "pid": None} for row in host.components()]
    return components, host.ask("units"), host.ask("behaviours")


def assert_read_by_pip(host: RunningHost) -> None:
    """pip finds in each component's venv what its lock says, and nothing broken."""
    components = []
    for venv in (host.state / "venvs").glob("*/*"):
        locked = pip_reader.locked(host.state / "payloads" / venv.parent.name, venv.name)
        assert pip_reader.listed(venv) == {wheel.name: wheel.version for wheel in locked}
        assert pip_reader.broken(venv) == ""
        components.append(venv.name)
    assert sorted(components) == ["scribe", "talker"]
