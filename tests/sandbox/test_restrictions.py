"""Each restriction matters: without it, and only without it, a hostile plugin gets somewhere."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.sandbox.baits import SMALL, attempted, laid, unlimited

from nondum.host.sandbox.levels import bubblewrap, refusals
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held

pytestmark = pytest.mark.anyio

BWRAP = shutil.which("bwrap") or "bwrap"

IN_A_SANDBOX = {
    "processes": ("see a process of the host", ()),
    "messages": ("attach to shared memory", ()),
    "host name": ("know the host name", ()),
    "network": ("connect by tcp", ()),
    "cgroups": ("know its control group", ()),
    "size of tmp": ("fill tmp", ()),
    "outside": ("see what init sees", ()),
    "system": ("write among its devices", ()),
    "nodes": ("change the mode of a device of the host", ()),
    "inotify": ("take all instances of inotify", ()),
    "code": ("change its own code", ()),
    "settings": ("write a setting of the kernel", ()),
    "user": ("be root", ()),
    "user namespaces": ("make a user namespace", ("namespaces",)),
    "capabilities": ("hold capabilities", ()),
    "environment": ("read the environment it was started with", ()),
    "filter": ("use keyrings", ()),
    "mounts": ("open a mount tree", ()),
    "namespaces": ("call unshare at all", ()),
    "spying": ("trace a child", ()),
    "keys": ("use keyrings", ()),
    "bpf": ("load a bpf program", ()),
    "perf": ("measure performance", ()),
    "userfaultfd": ("handle page faults", ()),
    "io_uring": ("use io uring", ()),
    "handles": ("name files by handle", ()),
    "kernel": ("change personality", ()),
    "terminal": ("type into a terminal", ()),
    "sockets": ("make an exotic pair", ()),
    "special files": ("leave a set id file", ()),
}
"""Restriction → what succeeds without it, and restrictions that hide it, to be left out too."""

ON_THE_HOST = {
    "landlock": ("read a file of the host", ("user",)),
    "capabilities": ("hold capabilities", ("user",)),
    "filter": ("trace a child", ("user",)),
    "environment": ("read the environment it was started with", ()),
    "session": ("be in the session of the host", ()),
    "new privileges": ("gain privileges", ("landlock", "filter")),
    "messages": ("attach to shared memory", ("user",)),
    "sockets": ("connect to a path", ("user",)),
    "spying": ("trace a child", ("user",)),
    "bare opens": ("open a file of the host neither to read nor to write", ("user",)),
    "metadata": ("change the mode of a file of the host", ("user",)),
    "scheduling": ("slow a process of the host down", ("user",)),
    "special files": ("leave a set id file", ("user", "metadata")),
}
"""Likewise of restricted workers. Landlock and filters need one that may gain no privileges."""

OF_OLD_LANDLOCK = {
    "truncation": ("truncate a file of the host", "truncate its own code"),
    "bare opens": ("open a file of the host neither to read nor to write",),
}
"""The same where Landlock does not know truncating."""

LIMITS = {
    "take all memory": ("memory_mb", 2048),
    "take all memory as shared memory": ("memory_mb", 2048),
    "take all memory as files in memory": ("memory_mb", 2048),
    "fork without end": ("tasks", 1000),
    "open files without end": ("descriptors", 1024),
    "write a huge file": ("file_mb", 100),
    "dump core": ("core_mb", 1),
}
"""What succeeds → of which limit it needs more."""


@pytest.fixture(scope="module")
def cgroup() -> Iterator[str]:
    """Where this process, and so whatever it starts, is in the hierarchy of control groups."""
    with moved() as name:
        yield name


@pytest.fixture(scope="module")
def bait(tmp_path_factory: pytest.TempPathFactory, cgroup: str) -> Iterator[dict[str, Any]]:
    with laid(tmp_path_factory.mktemp("bait"), cgroup) as bait:
        yield bait


@contextlib.contextmanager
def moved() -> Iterator[str]:
    """A control group of this process's own, in whichever hierarchy lets it have one."""
    for line in Path("/proc/self/cgroup").read_text(encoding="ascii").split():
        _, controllers, before = line.split(":", 2)
        root = Path("/sys/fs/cgroup") / (controllers.removeprefix("name=") or ".")
        own = root / before.lstrip("/") / f"nondum-restrictions-{os.getpid()}"
        with contextlib.suppress(OSError):
            own.mkdir(exist_ok=True)
            (own / "cgroup.procs").write_text(str(os.getpid()))
            try:
                yield own.name
                return
            finally:
                (own.parent / "cgroup.procs").write_text(str(os.getpid()))
                own.rmdir()
    yield ""


async def test_nothing_of_that_is_possible_in_a_whole_sandbox(
    tmp_path: Path, bait: dict[str, Any]
) -> None:
    names = [*(name for name, _ in IN_A_SANDBOX.values()), *LIMITS]
    assert not await possible(tmp_path, bait, Boxed(BWRAP), names)


async def test_nothing_of_that_is_possible_for_a_restricted_worker(
    tmp_path: Path, bait: dict[str, Any]
) -> None:
    """But for what only its being another user than the host's hides."""
    names = [name for name, _ in ON_THE_HOST.values()]
    assert not await possible(tmp_path, bait, Held(), names)


async def possible(
    folder: Path, bait: dict[str, Any], confinement: Confinement, names: Sequence[str]
) -> set[str]:
    """What of these attempts succeeds."""
    results = await attempted(folder, bait, confinement, list(dict.fromkeys(names)))
    assert set(results) == set(names)
    return {name for name, result in results.items() if result.could} - unlimited(folder)


@pytest.mark.parametrize("restriction", IN_A_SANDBOX)
async def test_restriction_of_a_sandbox_matters(
    tmp_path: Path, bait: dict[str, Any], restriction: str
) -> None:
    name, away = IN_A_SANDBOX[restriction]
    broken = Boxed(BWRAP, without=(*away, restriction))
    if away:  # else the whole sandbox is judged above
        assert not await possible(tmp_path / "rest", bait, Boxed(BWRAP, without=away), [name])
    result = (await attempted(tmp_path / "broken", bait, broken, [name]))[name]
    assert result.could, f"without {restriction}: {result.what}"


@pytest.mark.parametrize("restriction", ON_THE_HOST)
async def test_restriction_of_a_restricted_worker_matters(
    tmp_path: Path, bait: dict[str, Any], restriction: str
) -> None:
    name, away = ON_THE_HOST[restriction]
    broken = Held(without=(*away, restriction))
    if away:
        assert not await possible(tmp_path / "rest", bait, Held(without=away), [name])
    result = (await attempted(tmp_path / "broken", bait, broken, [name]))[name]
    assert result.could, f"without {restriction}: {result.what}"


@pytest.mark.parametrize("restriction", OF_OLD_LANDLOCK)
async def test_restriction_matters_where_landlock_is_older(
    tmp_path: Path, bait: dict[str, Any], restriction: str
) -> None:
    names = OF_OLD_LANDLOCK[restriction]
    whole = Held(without=["user"], abi=2)
    assert not await possible(tmp_path / "whole", bait, whole, names)
    broken = Held(without=["user", restriction], abi=2)
    assert await possible(tmp_path / "broken", bait, broken, names) == set(names)


@pytest.mark.parametrize("name", LIMITS)
async def test_limit_matters(tmp_path: Path, bait: dict[str, Any], name: str) -> None:
    limit, more = LIMITS[name]
    much = replace(SMALL, **{"memory_mb": 1024, limit: more})  # forks need some, too
    result = (await attempted(tmp_path / "much", bait, Boxed(BWRAP), [name], much))[name]
    assert result.could, result.what


def test_every_restriction_is_shown_to_matter() -> None:
    assert set(bubblewrap.NAMESPACES) <= set(IN_A_SANDBOX)
    assert set(refusals.GROUPS) <= set(IN_A_SANDBOX)
    assert set(refusals.WITHOUT_NAMESPACES) <= set(ON_THE_HOST)
    assert set(refusals.WITH_THE_HOSTS_USER) <= set(ON_THE_HOST)
    assert set(refusals.TRUNCATION) <= set(OF_OLD_LANDLOCK)
