"""Plugins that cannot start: each is one clear error, and nothing of it is left."""

from __future__ import annotations

import asyncio
import errno
import os
from dataclasses import replace
from pathlib import Path

import pytest
from tests.host.workers.trees import CountedTree
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left, open_descriptors
from tests.kit.processes import is_alive
from tests.kit.watches import watches_left
from tests.kit.workers import WorkersUnderTest

from nondum.host.core.events.workers import WorkerLogged, WorkerReady
from nondum.host.sandbox.cgroups.groups import Cgroups
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spec import WorkerSpec
from nondum.host.workers.unconfined import Unconfined
from nondum.sdk.description import Label, PluginDescription
from nondum.sdk.errors import WorkerFailed

pytestmark = pytest.mark.anyio

HERE = "print('here', flush=True)"
HOOKED = "from nondum.sdk import hookimpl\n@hookimpl\n{}"


async def failure(tested: WorkersUnderTest, source: str) -> WorkerFailed:
    with pytest.raises(WorkerFailed) as caught:
        await tested.start("guest", source)
    assert not tested.workers.pids()
    assert not tested.told(WorkerReady)
    return caught.value


@pytest.mark.parametrize(
    ("source", "code", "words"),
    [
        pytest.param("import nowhere_at_all", "IMPORT_FAILED", "nowhere_at_all", id="import"),
        pytest.param("def f(:", "IMPORT_FAILED", "SyntaxError", id="syntax"),
        pytest.param(
            HOOKED.format("def units():\n    raise ValueError('no units')"),
            "HOOK_FAILED",
            "no units",
            id="raises when described",
        ),
        pytest.param(
            HOOKED.format("async def start(ctx):\n    raise ValueError('no luck')"),
            "HOOK_FAILED",
            "no luck",
            id="raises when started",
        ),
        pytest.param(
            HOOKED.format("def starts(ctx): ..."), "HOOK_UNKNOWN", "starts", id="unknown hook"
        ),
        pytest.param(
            "import os, sys\nsys.stderr.write('out of paper\\n')\nos._exit(3)",
            "WORKER_START_FAILED",
            "exited with status 3 and said: out of paper",
            id="exits at once",
        ),
        pytest.param(
            "import os\nos.kill(os.getpid(), 11)",
            "WORKER_START_FAILED",
            "was ended by SIGSEGV",
            id="crashes",
        ),
    ],
)
async def test_start_fails_with_its_code(
    tested: WorkersUnderTest, source: str, code: str, words: str
) -> None:
    error = await failure(tested, source)
    assert error.code == code
    assert words in str(error)
    assert "guest" in error.problems[0].where


async def test_nothing_importable_tells_what_is_missing(
    tested: WorkersUnderTest, tmp_path: Path
) -> None:
    spec = replace(tested.spec("guest", ""), site_packages=(tmp_path,))
    with pytest.raises(WorkerFailed, match=r"'nondum'") as failed:
        await tested.workers.start(spec)
    assert failed.value.code == "WORKER_START_FAILED"


async def test_missing_interpreter_is_told(tested: WorkersUnderTest, tmp_path: Path) -> None:
    spec = replace(tested.spec("guest", ""), python=tmp_path / "python")
    with pytest.raises(WorkerFailed) as failed:
        await tested.workers.start(spec)
    assert failed.value.code in {"LAUNCH_FAILED", "WORKER_START_FAILED"}


@pytest.mark.parametrize(
    "hang",
    [
        pytest.param("{here}; await asyncio.Event().wait()", id="waits for ever"),
        pytest.param("{here}; time.sleep(3600)", id="blocks its loop"),
        pytest.param(
            "signal.signal(signal.SIGTERM, signal.SIG_IGN); {here}; time.sleep(3600)",
            id="ignores SIGTERM",
        ),
    ],
)
async def test_hang_in_start_is_ended(
    tested: WorkersUnderTest, clock: VirtualClock, hang: str
) -> None:
    start = HOOKED.format(f"async def start(ctx):\n    {hang.format(here=HERE)}")
    await hangs(tested, clock, f"import asyncio, signal, time\n{start}")


async def test_hang_while_imported_is_ended(tested: WorkersUnderTest, clock: VirtualClock) -> None:
    await hangs(tested, clock, f"import time\n{HERE}; time.sleep(3600)")


async def hangs(tested: WorkersUnderTest, clock: VirtualClock, source: str) -> None:
    """A worker that has come to `HERE` has its time for the start, and no more."""
    failing = asyncio.create_task(failure(tested, source))
    await tested.until(WorkerLogged, lambda line: line.message == "here")
    await clock.advance(tested.timing.startup_s * 0.9)
    assert not failing.done()
    await clock.advance(tested.timing.startup_s * 0.1)
    assert (await failing).code == "WORKER_HUNG"


async def test_lie_in_the_index_is_told_by_place(tested: WorkersUnderTest) -> None:
    honest = tested.spec("guest", "'''Honest.'''")
    index = PluginDescription("guest", "0", summary="Bold.", labels=(Label("a", "an a"),))
    with pytest.raises(WorkerFailed) as caught:
        await tested.workers.start(replace(honest, index=index))
    assert {p.code for p in caught.value.problems} == {"INDEX_MISMATCH"}
    told = str(caught.value)
    assert "index.summary" in told and "'Bold.'" in told and "'Honest.'" in told
    assert "index.labels[0]" in told


async def test_failed_start_can_be_tried_again(tested: WorkersUnderTest) -> None:
    spec = tested.spec("guest", "import nowhere_at_all")
    for _ in range(2):
        with pytest.raises(WorkerFailed):
            await tested.workers.start(spec)
    (spec.site_packages[0] / "guest_plugin.py").write_text("")
    await tested.workers.start(spec)
    assert list(tested.workers.pids()) == ["guest"]


async def endless_start(tested: WorkersUnderTest) -> tuple[asyncio.Task[WorkerSpec], int]:
    """A start that does not end by itself, and the worker's process."""
    source = "import asyncio\n" + HOOKED.format(
        "async def start(ctx):\n    print('here', __import__('os').getpid())\n"
        "    await asyncio.Event().wait()"
    )
    starting = asyncio.create_task(tested.start("guest", source))
    said = await tested.until(WorkerLogged, lambda line: line.message.startswith("here"))
    return starting, tested.pid("guest", said.message.split()[1])


async def test_component_removed_while_it_starts(tested: WorkersUnderTest) -> None:
    starting, pid = await endless_start(tested)
    await tested.workers.stop("guest")
    with pytest.raises(WorkerFailed, match="COMPONENT_REMOVED"):
        await starting
    assert not is_alive(pid)


async def test_cancelled_start_leaves_no_process(tested: WorkersUnderTest) -> None:
    starting, pid = await endless_start(tested)
    starting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await starting
    assert not is_alive(pid)


async def test_cancelled_start_that_is_stopped_too_leaves_no_process(
    tested: WorkersUnderTest,
) -> None:
    """As when a daemon ends while a payload is brought up."""
    starting, pid = await endless_start(tested)
    starting.cancel()
    await asyncio.sleep(0)
    await tested.workers.close()
    assert not is_alive(pid)
    with pytest.raises((asyncio.CancelledError, WorkerFailed)):
        await starting


async def test_start_waits_for_the_one_that_is_being_stopped(tested: WorkersUnderTest) -> None:
    source = HOOKED.format("async def stop(ctx):\n    await __import__('asyncio').sleep(0.3)")
    spec = await tested.start("guest", source)
    old = tested.workers.pids()["guest"]
    stopping = asyncio.create_task(tested.workers.stop("guest"))
    await asyncio.sleep(0)
    assert not tested.workers.pids()
    await tested.workers.start(spec)
    assert not is_alive(old)
    assert is_alive(tested.workers.pids()["guest"])
    await stopping
    assert is_alive(tested.workers.pids()["guest"])


async def test_second_worker_of_a_component_is_a_mistake(tested: WorkersUnderTest) -> None:
    spec = await tested.start("guest", "")
    with pytest.raises(ValueError, match="guest"):
        await tested.workers.start(spec)


@pytest.mark.parametrize(
    "watched",
    [
        pytest.param(0, id="its end"),
        pytest.param(1, id="its standard output"),
        pytest.param(2, id="its standard error"),
        pytest.param(3, id="its link"),
    ],
)
async def test_worker_that_cannot_be_watched_leaves_nothing(
    tested: WorkersUnderTest, watched: int
) -> None:
    tree = CountedTree()
    launcher = WorkerLauncher(Unconfined(), Cgroups(tree))
    tested.workers.launcher = launcher
    await tested.workers.keep_spare()
    spare = launcher.spare_pid
    assert spare is not None
    assert tree.names()
    spec, before = tested.spec("guest", ""), open_descriptors()
    with watches_left(watched), pytest.raises(WorkerFailed) as failed:
        await tested.workers.start(spec)
    assert failed.value.code == "LAUNCH_FAILED"
    assert os.strerror(errno.ENOSPC) in str(failed.value)
    assert not is_alive(spare)
    assert not tree.names()
    assert not open_descriptors() - before
    assert not tested.workers.pids()


async def test_worker_for_which_no_link_can_be_made_fails_to_start(
    tested: WorkersUnderTest,
) -> None:
    spec = tested.spec("guest", "")
    with descriptors_left(0), pytest.raises(WorkerFailed) as failed:
        await tested.workers.start(spec)
    assert failed.value.code == "LAUNCH_FAILED"
    assert os.strerror(errno.EMFILE) in str(failed.value)
