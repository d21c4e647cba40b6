"""Memory is promised to one payload at a time, on a real store, with real workers."""

from __future__ import annotations

import os
import resource
import sys
from dataclasses import asdict
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.host import LAMP, HostInProcess, host_in_process
from tests.kit.payloads import Part, make_payload

from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.step import Step
from nondum.host.jobs.install import install
from nondum.host.manager.headroom import Needs, used_mb
from nondum.host.manager.memory_reservations import total
from nondum.host.workers.spec import Timing
from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.payload.memory import Promised, free_memory_mb

FIRST, SECOND = "org.example.first", "org.example.second"
QUICK = Timing(startup_s=20.0, settle_beats=0)
BY_PAYLOAD = st.dictionaries(st.text("abc", max_size=2), st.integers(0, 10_000))


def greedy(root: Path, payload_id: str, memory_mb: int, release: int = 1) -> Path:
    """A drive whose payload asks for so much and uses little of it."""
    id = payload_id.rpartition(".")[2]
    drive = root / f"{id}-{release}"
    version = f"{release}.0"
    part = Part(id, LAMP, version=version)
    requires = f"memory_mb = {memory_mb}"
    make_payload(
        drive, part, payload_id=payload_id, version=version, release=release, requires=requires
    )
    return drive


def more_than_half() -> int:
    """Memory that one payload can be promised here, and two cannot."""
    return free_memory_mb() * 13 // 20


@pytest.mark.anyio
async def test_second_payload_that_counts_on_the_same_memory_is_refused(tmp_path: Path) -> None:
    asked_mb = more_than_half()
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(greedy(tmp_path, FIRST, asked_mb), "a")
        await host.until_step(FIRST, Step.ACTIVE)
        host.plug(greedy(tmp_path, SECOND, asked_mb), "b")
        await host.until(lambda: is_at(host, SECOND, Step.REFUSED))
        refused = host.payload(SECOND)
        assert refused is not None
        (problem,) = refused.problems
        assert (problem.code, problem.need) == ("NO_MEMORY", f"{asked_mb} MB")
        assert problem.message.endswith(f"MB are promised to {FIRST}")
        assert problem.fix.startswith("pull or uninstall it, or use another host")
        assert is_at(host, FIRST, Step.ACTIVE)
        host.pull("a")
        await host.until_gone(FIRST)
        host.bus.emit(RetryAsked(refused.key))
        await host.until(lambda: is_at(host, SECOND, Step.ACTIVE))


@pytest.mark.anyio
async def test_of_two_that_come_together_one_is_let_in(tmp_path: Path) -> None:
    """Both may have been copied by the time that one of them is promised anything."""
    drives = [greedy(tmp_path, payload_id, more_than_half()) for payload_id in (FIRST, SECOND)]
    async with host_in_process(tmp_path, timing=QUICK) as host:
        for drive, slot in zip(drives, "ab", strict=True):
            host.plug(drive, slot)

        def settled() -> bool:
            records = host.payload(FIRST), host.payload(SECOND)
            return {r.step for r in records if r} == {Step.ACTIVE, Step.REFUSED}

        await host.until(settled)
        (refused,) = (r for r in host.snapshot.payloads if r.step is Step.REFUSED)
        assert [problem.code for problem in refused.problems] == ["NO_MEMORY"]


@pytest.mark.anyio
async def test_upgrade_has_the_memory_of_the_release_before(tmp_path: Path) -> None:
    """And the next payload finds what is promised promised once."""
    asked_mb = more_than_half()
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(greedy(tmp_path, FIRST, asked_mb), "a")
        await host.until_step(FIRST, Step.ACTIVE)
        host.plug(greedy(tmp_path, FIRST, asked_mb, release=2), "b")

        def steps() -> dict[int, Step]:
            return {p.release: p.step for p in host.snapshot.payloads}

        await host.until(lambda: steps() == {1: Step.SUPERSEDED, 2: Step.ACTIVE})
        host.plug(greedy(tmp_path, SECOND, (free_memory_mb() - asked_mb) // 2), "c")
        await host.until_step(SECOND, Step.ACTIVE)


@pytest.mark.anyio
async def test_what_was_promised_is_promised_again_by_the_next_daemon(tmp_path: Path) -> None:
    first, second = (greedy(tmp_path, id, more_than_half()) for id in (FIRST, SECOND))
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(first, "a")
        await host.until_step(FIRST, Step.ACTIVE)
    async with host_in_process(tmp_path, timing=QUICK) as host:
        host.plug(second, "b")
        await host.until_step(FIRST, Step.ACTIVE)
        await host.until(lambda: is_at(host, SECOND, Step.REFUSED))


def test_what_was_promised_while_it_was_copied_counts(tmp_path: Path) -> None:
    """It is asked once more before anything is stored: between the two, others were let in."""
    promised = Promised(memory_mb=10**9, unused_mb=10**9)
    arguments = {
        "folder": str(greedy(tmp_path, FIRST, 1) / "nondum" / FIRST),
        "venvs": str(tmp_path / "venvs"),
        "store": str(tmp_path / "store"),
        "python": sys.executable,
        "method": "store",
        "reserve_mb": 0,
        "confinement": "none",
        "allow_unsigned": True,
        "headroom": {"promised": asdict(promised), "freed_mb": 0, "freed_gpu_mb": 0},
    }
    with pytest.raises(PayloadRefused) as refused:
        install(arguments, lambda phase, done, total: None)
    assert [problem.code for problem in refused.value.problems] == ["NO_MEMORY"]
    assert not (tmp_path / "store").exists()
    told = install({**arguments, "headroom": None}, lambda phase, done, total: None)
    assert told["needs"]["memory_mb"] == 1, "what was let in before is not asked again"


def is_at(host: HostInProcess, payload_id: str, step: Step) -> bool:
    record = host.payload(payload_id)
    return record is not None and record.step is step


@given(promised=BY_PAYLOAD, used=BY_PAYLOAD)
def test_what_one_payload_uses_is_not_another_ones(
    promised: dict[str, int], used: dict[str, int]
) -> None:
    """A payload that uses more than its reservation takes nothing from the other reservations."""
    made = {key: Needs(f"id-{key}", mb) for key, mb in promised.items()}
    whole = total(made, used)
    alone = [total({key: needs}, used).unused_mb for key, needs in made.items()]
    assert whole.unused_mb == sum(alone) <= whole.memory_mb == sum(promised.values())
    held = {key for key, mb in promised.items() if mb > used.get(key, 0)}
    assert set(whole.holders) == {f"id-{key}" for key in held}
    assert all(0 <= one <= promised[key] for key, one in zip(made, alone, strict=True))


@pytest.mark.skipif(os.geteuid() != 0, reason="becomes another user")
def test_of_another_users_process_it_is_known_what_is_in_memory() -> None:
    """That is what daemons see of workers of another user."""
    daemon = os.getpid()
    reads, writes = os.pipe()
    child = os.fork()
    if not child:
        os.setuid(65534)
        os.write(writes, b"%d" % used_mb([daemon]))
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    seen_mb = int(os.read(reads, 100))
    os.close(reads)
    os.close(writes)
    assert 0 < seen_mb <= resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
