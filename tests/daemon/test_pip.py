"""`install.method = "pip"` makes the same robot of the same payload."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.daemon.plugins import scribe, talker
from tests.kit.running_host import COMMAND, RunningHost, running

pytestmark = pytest.mark.daemon

PIP = '[install]\nmethod = "pip"\n'


def test_pip_makes_the_same_components(tmp_path: Path) -> None:
    with running(tmp_path / "store", program=COMMAND) as host:
        expected = made_of(host)
    with running(tmp_path / "pip", more=PIP, program=COMMAND) as host:
        assert made_of(host) == expected
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
