"""Data payloads on a real store, shown to real workers: late, early, shared, known already."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from tests.kit.host import HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload

from nondum.host.core.records.step import Step
from nondum.host.manager.install_options import InstallOptions
from nondum.planning.execute.running import RunState
from nondum.wheelhouse.build import data_payload

pytestmark = pytest.mark.anyio

READER = '''"""Reads what it is shown."""
from nondum.sdk import BehaviourFailed, Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain reader)
  (:predicates (had ?u - mind))
  (:action read :parameters (?u - mind) :precondition (ready ?u) :effect (had ?u)))
"""

@hookimpl
def units():
    return [Unit("mind", "mind")]

@hookimpl
def fragments():
    return [Fragment("reader.pddl", DOMAIN)]

@behaviour("read", action="(read ?u - mind)")
async def read(ctx, u):
    data = ctx.data("weights")
    said = f"{data.name} {data.version} {data.path.read_text()}" if data else "nothing"
    raise BehaviourFailed(said, code="READ")
'''
NEEDS = '[[component.data]]\nname = "weights"\nkind = "text"\n'
READER_ID, WORDS_ID = "org.example.reader", "org.example.words"


def reader(drive: Path, id: str = "reader") -> Path:
    return make_payload(drive, Part(id, READER, manifest=NEEDS), payload_id=f"org.example.{id}")


def words(drive: Path, text: str, *, version: str = "1", release: int = 1) -> Path:
    drive.mkdir(parents=True, exist_ok=True)
    (drive / "words.txt").write_text(text)
    return data_payload.write(
        drive,
        WORDS_ID,
        [drive / "words.txt"],
        name="words",
        kind="text",
        version=version,
        release=release,
    )


async def answer_of(host: HostInProcess, component: str = "reader") -> str:
    call = host.workers.behave(component, "read", {"u": f"spot__{component}__mind"})
    assert await call.ended() is RunState.FAILED
    return call.reason


def is_ready(host: HostInProcess, component: str = "reader") -> bool:
    found = host.snapshot.component(component)
    return found is not None and found.is_ready


async def until_said(host: HostInProcess, text: str, component: str = "reader") -> None:
    """Wait until a component says so: its worker is told after the state has changed."""
    while text not in await answer_of(host, component):
        pass


async def test_data_come_late_leave_early_and_come_again(tmp_path: Path) -> None:
    reader(tmp_path / "reader")
    words(tmp_path / "words", "hello")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "reader", "reader")
        await host.until_step(READER_ID, Step.ACTIVE)
        assert not is_ready(host)
        assert "nothing" in await answer_of(host)
        for _ in range(2):
            host.plug(tmp_path / "words", "words")
            await host.until(lambda: is_ready(host))
            await until_said(host, "words 1 hello")
            host.pull("words")
            await host.until(lambda: not is_ready(host))
            await until_said(host, "nothing")
            await host.until_gone(WORDS_ID)
        copied = [e.detail for e in await host.journal() if e.event == "PayloadCopied"]
        assert copied[-1]["bytes_copied"] == 0
        assert copied[-1]["bytes_known"] >= len("hello")
        host.pull("reader")
        await host.until_gone(READER_ID)
        assert not left_over(host.folders)


async def test_a_component_that_comes_later_is_shown_what_is_here(tmp_path: Path) -> None:
    reader(tmp_path / "reader")
    words(tmp_path / "words", "hello")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "words", "words")
        await host.until_step(WORDS_ID, Step.ACTIVE)
        host.plug(tmp_path / "reader", "reader")
        await host.until(lambda: is_ready(host))
        await until_said(host, "words 1 hello")


async def test_several_components_read_one_file(tmp_path: Path) -> None:
    for id in ("left", "right"):
        reader(tmp_path / id, id)
    words(tmp_path / "words", "hello")
    async with host_in_process(tmp_path) as host:
        for name in ("left", "right", "words"):
            host.plug(tmp_path / name, name)
        for id in ("left", "right"):
            await host.until(lambda id=id: is_ready(host, id))  # type: ignore[misc]  # bound now
            await until_said(host, "hello", id)
        (kept,) = (host.folders.root / "data").iterdir()
        assert kept.stat().st_nlink == 4  # the store's, the payload's and one for each reader


async def test_a_newer_release_is_shown_instead(tmp_path: Path) -> None:
    reader(tmp_path / "reader")
    words(tmp_path / "old", "hello")
    words(tmp_path / "new", "goodbye", version="2", release=2)
    async with host_in_process(tmp_path) as host:
        for name in ("reader", "old"):
            host.plug(tmp_path / name, name)
        await host.until(lambda: is_ready(host))
        await until_said(host, "words 1 hello")
        host.plug(tmp_path / "new", "new")
        await until_said(host, "words 2 goodbye")
        host.pull("new")
        await until_said(host, "words 1 hello")


async def test_a_release_that_takes_over_is_shown_what_the_one_before_was(tmp_path: Path) -> None:
    reader(tmp_path / "reader")
    words(tmp_path / "words", "hello")
    newer = Part("reader", READER.replace("said, code", 'f"2: {said}", code'), manifest=NEEDS)
    make_payload(tmp_path / "newer", newer, payload_id=READER_ID, release=2)
    async with host_in_process(tmp_path) as host:
        for name in ("words", "reader"):
            host.plug(tmp_path / name, name)
        await host.until(lambda: is_ready(host))
        await until_said(host, "words 1 hello")
        host.plug(tmp_path / "newer", "newer")
        await host.until_releases(READER_ID, r1=Step.SUPERSEDED, r2=Step.ACTIVE)
        await until_said(host, "2: words 1 hello")
        host.pull("newer")
        await host.until_releases(READER_ID, r1=Step.ACTIVE, r2=None)
        assert is_ready(host)
        await until_said(host, "words 1 hello")


async def test_a_worker_that_crashed_is_shown_the_same_again(tmp_path: Path) -> None:
    reader(tmp_path / "reader")
    words(tmp_path / "words", "hello")
    async with host_in_process(tmp_path) as host:
        for name in ("reader", "words"):
            host.plug(tmp_path / name, name)
        await host.until(lambda: is_ready(host))
        pid = host.workers.pids()["reader"]
        os.kill(pid, signal.SIGKILL)
        await host.until(lambda: host.workers.pids().get("reader", pid) != pid and is_ready(host))
        assert "words 1 hello" in await answer_of(host)


async def test_data_that_were_changed_in_the_store_are_copied_again(tmp_path: Path) -> None:
    words(tmp_path / "words", "hello")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "words", "words")
        await host.until_step(WORDS_ID, Step.ACTIVE)
        host.pull("words")
        await host.until_gone(WORDS_ID)
    # The next daemon has nothing cached.
    (kept,) = (tmp_path / "state/data").iterdir()
    kept.chmod(0o644)
    kept.write_text("hollo")
    async with host_in_process(tmp_path) as host:
        host.plug(tmp_path / "words", "words")
        record = await host.until_step(WORDS_ID, Step.REFUSED)
        assert [problem.code for problem in record.problems] == ["STORE_DAMAGED"]
        host.pull("words")
        await host.until_gone(WORDS_ID)
        host.plug(tmp_path / "words", "words")
        await host.until_step(WORDS_ID, Step.ACTIVE)
        assert kept.read_text() == "hello"


async def test_data_stay_under_the_stores_quota(tmp_path: Path) -> None:
    words(tmp_path / "words", "hello")
    options = InstallOptions(allow_unsigned=True, quota_mb=0)
    async with host_in_process(tmp_path, options=options) as host:
        host.plug(tmp_path / "words", "words")
        await host.until_step(WORDS_ID, Step.ACTIVE)
        assert [row["bytes"] for row in await host.executor.installation.listing()] == [5]
        host.pull("words")
        await host.until_gone(WORDS_ID)
        await host.executor.installation.prune()
        assert await host.executor.installation.listing() == []


async def test_a_daemon_that_was_killed_shows_the_same_again(tmp_path: Path) -> None:
    reader(tmp_path / "reader")
    words(tmp_path / "words", "hello")
    for _ in range(2):
        async with host_in_process(tmp_path) as host:
            for name in ("reader", "words"):
                if not (host.slots / name).is_symlink():
                    host.plug(tmp_path / name, name)
            await host.until(lambda host=host: is_ready(host))  # type: ignore[misc]  # bound now
            await until_said(host, "words 1 hello")
