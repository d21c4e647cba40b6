"""Payloads that are wrong end as one clear problem, and all else goes on as it was."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.host.lifecycle.bad_payloads import BAD, EXITS_LATER, WAYS, Bad, bare
from tests.kit.clock import VirtualClock
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload

from nondum.host.core.records.component import ComponentState
from nondum.host.core.records.step import Step
from nondum.host.workers.spec import Timing

pytestmark = pytest.mark.anyio

GOOD = "org.example.good"
TIMING = Timing(backoff_s=0.0, missed=1_000_000)
"""Time is virtual here: only what hangs at its start is judged by it."""


@pytest.fixture(scope="module")
def anyio_backend() -> tuple[str, dict[str, Any]]:
    return "asyncio", {"loop_factory": VirtualClock}


@pytest.fixture(scope="module")
async def host(
    anyio_backend: object, tmp_path_factory: pytest.TempPathFactory
) -> AsyncIterator[HostInProcess]:
    """A host with a good payload, on which one bad payload after the other is tried."""
    root = tmp_path_factory.mktemp("bad")
    make_payload(root / "good", Part("good", LAMP), payload_id=GOOD)
    async with host_in_process(root, timing=TIMING) as host:
        host.plug(root / "good", "good")
        await host.until_step(GOOD, Step.ACTIVE)
        yield host
        host.pull("good")
        await host.until_gone(GOOD)
        assert not left_over(host.folders)


@pytest.fixture(autouse=True)
async def nothing_is_left_behind(host: HostInProcess) -> AsyncIterator[None]:
    """What is good goes on as if nothing had happened, and nothing bad stays when it is pulled."""
    untouched = host.workers.pids(), host.snapshot.components, set(left_over(host.folders))
    host.heard.clear()
    yield
    if (host.slots / "bad").is_symlink():
        host.pull("bad")
    await host.until(lambda: {drive.id for drive in host.snapshot.drives} == {"good"})
    await host.until(lambda: {payload.payload_id for payload in host.snapshot.payloads} == {GOOD})
    assert (host.workers.pids(), host.snapshot.components) == untouched[:2]
    assert set(left_over(host.folders)) == untouched[2]


@pytest.mark.parametrize("bad", WAYS, ids=lambda bad: bad.id)
async def test_bad_payload_is_told_with_its_code(
    host: HostInProcess, clock: VirtualClock, bad: Bad, tmp_path: Path
) -> None:
    bad.write(tmp_path / "bad")
    known = len(await host.catalogue.journal(subject=BAD))
    host.plug(tmp_path / "bad", "bad")
    if bad.hangs:
        await host.until_step(BAD, Step.STORED)
        await clock.advance_until(host.until_step(BAD, bad.step), step_s=TIMING.startup_s)
    record = await host.until_step(BAD, bad.step)
    assert {problem.code for problem in record.problems} == {bad.code}, record.problems
    journal = await host.catalogue.journal(subject=BAD)
    told = [problem for entry in journal[known:] for problem in entry.problems]
    assert told == list(record.problems)
    assert host.snapshot.component("bad") is None


async def test_preflight_tells_all_problems_at_once(host: HostInProcess, tmp_path: Path) -> None:
    requires = 'python = ">=3.99"\nmemory_mb = 99999999\ndisk_mb = 999999999'
    make_payload(tmp_path / "bad", bare(""), payload_id=BAD, requires=requires)
    host.plug(tmp_path / "bad", "bad")
    record = await host.until_step(BAD, Step.REFUSED)
    codes = {problem.code for problem in record.problems}
    assert codes == {"PYTHON_VERSION", "NO_MEMORY", "DISK_FULL"}
    assert all(problem.need and problem.have for problem in record.problems)


async def test_plugin_that_ends_again_and_again_is_quarantined(
    host: HostInProcess, tmp_path: Path
) -> None:
    make_payload(tmp_path / "bad", bare(EXITS_LATER), payload_id=BAD)
    host.plug(tmp_path / "bad", "bad")
    await host.until_step(BAD, Step.ACTIVE)

    def given_up() -> bool:
        component = host.snapshot.component("bad")
        return component is not None and component.state is ComponentState.QUARANTINED

    await host.until(given_up)
    component = host.snapshot.component("bad")
    assert component is not None
    assert component.problems[0].code == "WORKER_CRASH_LOOP"


async def test_drive_without_payload_is_told_and_let_go(
    host: HostInProcess, tmp_path: Path
) -> None:
    (tmp_path / "holiday").mkdir()
    host.plug(tmp_path / "holiday", "bad")
    await host.until(lambda: any(drive.problems for drive in host.snapshot.drives))
    (drive,) = (drive for drive in host.snapshot.drives if drive.problems)
    assert [problem.code for problem in drive.problems] == ["DRIVE_NOT_PAYLOAD"]


async def test_no_code_of_a_refused_wheel_has_run(host: HostInProcess, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    source = f"open({str(canary)!r}, 'w')"
    part = replace(bare(source), files={"sitecustomize.py": source})
    make_payload(tmp_path / "bad", part, payload_id=BAD)
    host.plug(tmp_path / "bad", "bad")
    await host.until_step(BAD, Step.REFUSED)
    assert not has_run(canary)


def has_run(canary: Path) -> bool:
    return canary.exists()
