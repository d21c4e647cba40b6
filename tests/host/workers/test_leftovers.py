"""What a worker leaves behind is cleared away: all of it that can be."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from tests.host.workers.trees import StuckTree
from tests.kit.processes import is_alive, until_gone
from tests.kit.workers import WorkersUnderTest

from nondum.host.core.events.workers import WorkerLogged
from nondum.host.sandbox.cgroups.groups import Cgroups
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.leftovers import clear_away
from nondum.host.workers.unconfined import Unconfined

pytestmark = pytest.mark.anyio

RUNAWAY = (
    "import os, subprocess\n"
    "child = subprocess.Popen(['sleep', '600'], start_new_session=True)\n"
    "open('child', 'w').write(str(child.pid))\n"
)


async def test_runaway_is_ended_where_the_cgroup_cannot_be(tmp_path: Path) -> None:
    tested = WorkersUnderTest(tmp_path, confinement=Unconfined())
    tested.workers.launcher = WorkerLauncher(Unconfined(), Cgroups(StuckTree()))
    try:
        spec = await tested.start("cam", RUNAWAY)
        runaway = int((spec.scratch / "child").read_text(encoding="ascii"))
        assert is_alive(runaway)
    finally:
        await tested.workers.close()
    await until_gone(runaway)
    (told,) = tested.told(WorkerLogged)
    assert told.level == "error"
    assert os.strerror(errno.EIO) in told.message


def test_every_step_is_taken_before_a_failure_is_told() -> None:
    taken: list[str] = []

    def take(step: str) -> None:
        taken.append(step)
        if step.startswith("bad"):
            raise OSError(step)

    with pytest.raises(OSError, match="bad processes"):
        clear_away(
            lambda: take("bad cgroup"), lambda: take("bad processes"), lambda: take("good nodes")
        )
    assert taken == ["bad cgroup", "bad processes", "good nodes"]
