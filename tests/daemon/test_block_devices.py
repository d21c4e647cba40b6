"""Real block devices with a real file system, plugged into a whole host and pulled."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.daemon.plugins import scribe, talker
from tests.kit.disk_images import cut_off, image
from tests.kit.loop_devices import attached, detach
from tests.kit.payloads import make_wheel
from tests.kit.running_host import RunningHost, running
from tests.kit.traces import until_unmounted

pytestmark = [
    pytest.mark.daemon,
    pytest.mark.skipif(
        os.geteuid() != 0 or not Path("/dev/loop-control").exists(),
        reason="loop devices need root",
    ),
]

PAYLOAD = "lamp"
"""What `image` calls the payload that it writes."""


@pytest.fixture
def host(tmp_path: Path) -> Iterator[RunningHost]:
    """A host that takes loop devices on images in this test's folder."""
    program = (sys.executable, "-m", "tests.daemon.loop_daemon", str(tmp_path))
    with running(tmp_path / "host", program=program) as host:
        yield host


def test_stick_pulled_in_the_middle_of_a_behaviour(host: RunningHost, tmp_path: Path) -> None:
    host.bring("write", scribe())
    goal = host.want("(written spot)")
    host.until_goal(goal, "suspended")
    before = host.traces()
    with attached(image(tmp_path, talker())) as node:
        host.until_step(PAYLOAD, "active")
        host.until("safe to pull", lambda v: {d["state"] for d in v["drives"]} == {"idle"})
        assert not host.traces().mounts
        host.until_goal(goal, "holds")
        detach(node)
        host.until_gone(PAYLOAD)
    host.until_goal(goal, "suspended")
    assert host.traces() == before
    assert len(host.view["drives"]) == 1


def test_stick_that_dies_while_it_is_copied(host: RunningHost, tmp_path: Path) -> None:
    before = host.traces()
    ballast = make_wheel(tmp_path, "ballast", "1.0", {"ballast.bin": os.urandom(24 * 1024**2)})
    file = image(tmp_path, talker(wheels=[ballast]), size_mb=64)
    with attached(file):
        cut_off(file)
        host.until_told("DRIVE_GONE")
        host.until_gone(PAYLOAD)
        until_unmounted(host.state)
    host.until("let go", lambda view: not view["drives"])
    assert host.traces() == before
    assert "DRIVE_GONE" in str(host.journal())
