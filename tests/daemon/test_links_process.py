"""`[peers] process = true`: another process holds a daemon's links, and the daemon outlives it."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from tests.daemon.neighbours import neighbours, until_peer
from tests.kit.processes import is_alive
from tests.kit.running_host import RunningHost
from tests.kit.until import until

pytestmark = pytest.mark.daemon


def test_daemon_says_when_it_has_ended_and_finds_its_peers_again(tmp_path: Path) -> None:
    with neighbours(tmp_path, "rover", "mule", more="process = true\n") as (rover, mule):
        first = until("it runs", lambda: links_of(rover))
        assert first is not None
        assert str(first) in rover.run("peers", "--why").out
        os.kill(first, signal.SIGKILL)
        rover.until_told("LINKS_DIED")
        until("there is another", lambda: links_of(rover) not in (None, first))
        until_peer(rover, "mule")
        until_peer(mule, "rover")


def test_it_ends_with_a_daemon_that_is_killed(tmp_path: Path) -> None:
    with neighbours(tmp_path, "rover", more="process = true\n") as (rover,):
        links = until("it runs", lambda: links_of(rover))
        assert links is not None
        rover.kill()
        until("it has ended, too", lambda: not is_alive(links))


def links_of(host: RunningHost) -> int | None:
    pid: int | None = host.ask("peers_why")["process"]
    return pid
