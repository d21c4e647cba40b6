"""A hostile plugin comes on a drive like any other, and is as confined as the host says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.daemon.plugins import talker
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost
from tests.sandbox.baits import ESCAPE, LEFT_WHEN_RESTRICTED, judged, laid
from tests.sandbox.escape import ATTEMPTS

pytestmark = pytest.mark.daemon

FLOODS = {
    *("fill tmp", "fill shared memory", "fork without end", "take all memory"),
    *("take all memory as shared memory", "take all memory as files in memory"),
    *("open files without end", "write a huge file"),
}
"""Held, too, but by limits that other tests are about."""


def test_hostile_payload_gets_nowhere(host: RunningHost, tmp_path: Path) -> None:
    host.bring("talker", talker())
    talking = host.until_component("talker", "ready")
    with laid(tmp_path) as bait:
        attempts = [name for name in ATTEMPTS if name not in FLOODS]
        settings = json.dumps({**bait, "attempts": attempts})
        manifest = f"[component.settings]\nbait = '''{settings}'''\n"
        host.bring("escape", Part("escape", ESCAPE.read_text(encoding="utf-8"), manifest=manifest))
        said = [row["message"] for row in host.ask("logs", component="escape")]
    rows = [json.loads(s.removeprefix("tried ")) for s in said if s.startswith("tried {")]
    assert {row["name"] for row in rows} == set(attempts)
    could = {row["name"] for row in rows if judged(row).could}
    level = host.ask("status")["confinement"]["level"]
    assert could <= (set() if level == "sandboxed" else LEFT_WHEN_RESTRICTED)
    assert host.until_component("escape", "ready")["confinement"] == level
    assert host.component("talker") == talking, "the other one never noticed"
