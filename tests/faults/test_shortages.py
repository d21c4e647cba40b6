"""A daemon that has no descriptors or memory left refuses in words, lives, and can do it later."""

from __future__ import annotations

import contextlib
import os
import resource
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.faults.model import check
from tests.faults.play import Player, codes_of
from tests.faults.points import prepare
from tests.faults.ways import Way, sound
from tests.kit.fork_server import Nursery

pytestmark = pytest.mark.slow


def without_descriptors(pid: int) -> None:
    """It may open two more than it has."""
    used = len(list(Path(f"/proc/{pid}/fd").iterdir()))
    limit(pid, resource.RLIMIT_NOFILE, used + 2)


def without_memory(pid: int) -> None:
    """It may not grow by more than a megabyte."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[0])
    limit(pid, resource.RLIMIT_AS, pages * os.sysconf("SC_PAGE_SIZE") + 1024**2)


def limit(pid: int, what: int, soft: int) -> None:
    _, hard = resource.prlimit(pid, what)
    resource.prlimit(pid, what, (soft, hard))


def relieve(pid: int) -> None:
    for what in (resource.RLIMIT_NOFILE, resource.RLIMIT_AS):
        with contextlib.suppress(ProcessLookupError):
            _, hard = resource.prlimit(pid, what)
            resource.prlimit(pid, what, (hard, hard))


@pytest.mark.parametrize("shortage", [without_descriptors, without_memory])
def test_shortage_is_told_and_survived(
    nursery: Nursery, tmp_path: Path, shortage: Callable[[int], None]
) -> None:
    prepare(tmp_path, {"a": sound})
    script = ("plug a", "pull a", "plug a")
    player = Player(tmp_path, script, before=shortage, between={2: relieve})
    nursery.run({"root": str(tmp_path)}, player.play, expect=0)
    assert not player.stuck
    assert set(codes_of(tmp_path)) <= {"NO_RESOURCES", "NO_MEMORY", "LAUNCH_FAILED"}
    ended = check(tmp_path)
    assert not ended.wrong
    assert not Way().out_of_place(ended.steps)
