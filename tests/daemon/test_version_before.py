"""A host of the version before is upgraded, its payloads run, and it is a peer.

What it left, built and said is in `tests/data/version_before`.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.daemon.former_peer import FormerPeer
from tests.daemon.neighbours import open_host, until_peer, until_shared
from tests.daemon.plugins import scribe
from tests.kit import version_before
from tests.kit.running_host import RunningHost, running
from tests.kit.version_before import CRIER

pytestmark = pytest.mark.daemon

MOUTH = "spot__crier__mouth"
INSTALLED = f"installed/{CRIER}"
GOAL = "1"
"""The number of what was asked for there: “cry the hours”."""


def test_what_a_daemon_left_is_taken_over(tmp_path: Path) -> None:
    """The payload was installed; its drive was in, too, and was pulled while no daemon ran."""
    drive = version_before.unpack(tmp_path)
    stored = files(tmp_path / "state/store")
    with running(tmp_path) as host:
        host.until_step("crier", "active")
        assert host.until_goal(GOAL, "holds")["text"] == "cry the hours"
        assert hour(host) == "one"
        assert pose(host, MOUTH) == [0.1, 0.2, 0.3]
        assert sources(host) == {INSTALLED}
        assert host.journal()[0]["id"] == 1, "it goes on where it was"
        host.plug(drive)
        host.until("its drive is known", lambda _: sources(host) == {INSTALLED, "drive"})
        assert len(fresh_wheels(host)) == 1, "it was installed once, by the version before"
    after = files(tmp_path / "state/store")
    assert after.items() >= stored.items(), "no file that was stored is written again"


def test_payload_that_was_built_with_its_sdk_runs(host: RunningHost, tmp_path: Path) -> None:
    """Streams, values, settings and words go between it, this host and a plugin of today."""
    host.plug(version_before.unpack(tmp_path))
    host.until_step("crier", "active")
    host.bring("write", scribe())
    host.until_goal(host.want("(written spot)"), "holds")
    host.until_goal(str(host.ask("goal", words="cry the hours")["id"]), "holds")
    assert hour(host) == "one"


def test_host_that_was_not_upgraded_is_a_peer(tmp_path: Path) -> None:
    with open_host(tmp_path, "spot") as (host, address), FormerPeer(address) as peer:
        peer.greet()
        until_peer(host, "before")
        peer.tell()
        until_shared(host, "crier@before")
        assert "cry the hours" in {row["words"] for row in host.ask("goals")["can"]}


def files(folder: Path) -> dict[str, int]:
    """Unpacked files of a store: path → inode."""
    every = (path for path in folder.glob("*/files/**/*") if path.is_file())
    return {str(path.relative_to(folder)): path.stat().st_ino for path in every}


def sources(host: RunningHost) -> set[str]:
    """What the crier's payload is here by."""
    row = host.payload("crier")
    return set(row["drive"].split(", ")) if row is not None else set()


def fresh_wheels(host: RunningHost) -> list[int]:
    """How many wheels had to be unpacked, each time that the crier was installed."""
    stored = (row for row in host.journal(CRIER) if row["event"] == "WheelsStored")
    return [row["detail"]["fresh"] for row in stored]


def hour(host: RunningHost) -> str:
    """What the crier says that it has cried."""
    return str(host.facts()[f"hour {MOUTH}"][1]["text"])


def pose(host: RunningHost, unit: str) -> list[float]:
    """Where a unit is mounted."""
    (found,) = (row["xyz"] for row in host.ask("units") if row["unit"] == unit)
    return list(found)
