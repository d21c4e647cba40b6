"""Payloads that are wrong end as one clear problem, and nobody else notices."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from tests.kit.host import LAMP, HostInProcess, host_in_process, left_over
from tests.kit.payloads import Part, make_payload, make_wheel, manifest_text, seal

from nondum.host.catalogue.records import ComponentState, Step
from nondum.host.workers import Timing
from nondum.sdk.description import PluginDescription

pytestmark = pytest.mark.anyio

GOOD = "org.example.good"
BAD = "org.example.bad"
NOTHING = PluginDescription(name="test-bad", version="1.0")


def bare(source: str) -> Part:
    """A plugin whose index says nothing, whatever its source does."""
    return Part("bad", source, description=NOTHING)


def spoil(change: Callable[[Path], None]) -> Callable[[Path], None]:
    """A sound payload that something happened to afterwards."""

    def write(drive: Path) -> None:
        change(make_payload(drive, Part("bad", LAMP), payload_id=BAD))

    return write


def of(part: Part, **options: Any) -> Callable[[Path], None]:
    def write(drive: Path) -> None:
        make_payload(drive, part, payload_id=BAD, **options)

    return write


def flip(folder: Path) -> None:
    wheel = next((folder / "wheels").glob("test_bad-*.whl"))
    data = bytearray(wheel.read_bytes())
    data[len(data) // 2] ^= 0xFF
    wheel.write_bytes(data)


def flip_and_seal(folder: Path) -> None:
    """The list vouches for a wheel that is damaged inside."""
    flip(folder)
    lock = folder / "pylock.bad.toml"
    wheel = next((folder / "wheels").glob("test_bad-*.whl"))
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    lines = lock.read_text().splitlines()
    after = next(i for i, line in enumerate(lines) if wheel.name in line and "path" in line)
    at = next(i for i in range(after, len(lines)) if "sha256" in lines[i])
    lines[at] = f'hashes = {{ sha256 = "{digest}" }}'
    lock.write_text("\n".join(lines))
    seal(folder, payload_id=BAD)


def without_list(folder: Path) -> None:
    (folder / "CONTENTS").unlink()


def with_link(folder: Path) -> None:
    index = folder / "index.json"
    index.rename(folder / "real.json")
    index.symlink_to("real.json")


def without_wheel(folder: Path) -> None:
    next((folder / "wheels").glob("test_bad*")).unlink()


def needs_absent(drive: Path) -> None:
    drive.mkdir()
    helper = make_wheel(
        drive, "helper", "1.0", {"helper.py": ""}, requires=["not-on-this-drive>=2"]
    )
    make_payload(drive, replace(bare(""), wheels=[helper]), payload_id=BAD)


def with_hook(drive: Path) -> None:
    part = replace(bare(""), files={"evil.pth": "import os; os.system('touch /tmp/canary')\n"})
    make_payload(drive, part, payload_id=BAD)


def shadowing(drive: Path) -> None:
    make_payload(drive, replace(bare(""), files={"json/__init__.py": ""}), payload_id=BAD)


SLEEPS = "import time\ntime.sleep(3600)\n"
HANGS_AT_START = """from nondum.sdk import hookimpl
@hookimpl
def start(ctx):
    import time
    time.sleep(3600)
"""
RAISES = """from nondum.sdk import hookimpl
@hookimpl
def units():
    raise RuntimeError("no units today")
"""
RAISES_AT_START = """from nondum.sdk import hookimpl
@hookimpl
async def start(ctx):
    raise RuntimeError("cannot start")
"""
EXITS_LATER = """import os
from nondum.sdk import hookimpl
@hookimpl
async def start(ctx):
    ctx.spawn(leave(ctx))
async def leave(ctx):
    await ctx.sleep(0.1)
    os._exit(3)
"""


@dataclass(frozen=True)
class Bad:
    """One way to be wrong."""

    id: str
    write: Callable[[Path], None]
    code: str
    step: Step = Step.REFUSED


WAYS = (
    Bad(
        "architecture", of(replace(bare(""), tag="cp311-cp311-linux_riscv64")), "WHEEL_INCOMPATIBLE"
    ),
    Bad("python", of(bare(""), requires='python = ">=3.99"'), "PYTHON_VERSION"),
    Bad("memory", of(bare(""), requires="memory_mb = 99999999"), "NO_MEMORY"),
    Bad("gpu", of(bare(""), requires="gpu_memory_mb = 99999999"), "NO_GPU_MEMORY"),
    Bad("disk", of(bare(""), requires="disk_mb = 999999999"), "DISK_FULL"),
    Bad("confinement", of(bare(""), requires="confinement = 3"), "CONFINEMENT"),
    Bad("dependency", needs_absent, "LOCK_INCOMPLETE"),
    Bad("toml", of(bare(""), manifest="id = [\n"), "MANIFEST_TOML"),
    Bad("unknown-key", of(replace(bare(""), manifest="colour = 1")), "MANIFEST_KEY"),
    Bad("wrong-type", of(bare(""), requires='disk_mb = "much"'), "MANIFEST_VALUE"),
    Bad("no-component", of(bare(""), manifest=f'id = "{BAD}"\nname = "x"\n'), "MANIFEST_KEY"),
    Bad(
        "wrong-id", of(bare(""), manifest=manifest_text("Not An Id", [bare("")])), "MANIFEST_VALUE"
    ),
    Bad("index-format", of(bare(""), index={"format": 99}), "INDEX_INVALID"),
    Bad("index-empty", of(bare(""), index={"format": 1, "components": {}}), "INDEX_INVALID"),
    Bad("no-list", spoil(without_list), "CONTENTS_MISSING"),
    Bad("flipped-byte", spoil(flip), "HASH_MISMATCH"),
    Bad("damaged-wheel", spoil(flip_and_seal), "WHEEL_RECORD"),
    Bad("missing-file", spoil(without_wheel), "FILE_MISSING"),
    Bad("symlink", spoil(with_link), "PATH_UNSAFE"),
    Bad("startup-hook", with_hook, "WHEEL_STARTUP_HOOK"),
    Bad("shadowing", shadowing, "WHEEL_SHADOWS"),
    Bad("import", of(bare("import no_such_module")), "IMPORT_FAILED", Step.QUARANTINED),
    Bad("hook", of(bare(RAISES)), "HOOK_FAILED", Step.QUARANTINED),
    Bad("start", of(bare(RAISES_AT_START)), "HOOK_FAILED", Step.QUARANTINED),
    Bad("lie", of(Part("bad", LAMP, description=NOTHING)), "INDEX_MISMATCH", Step.QUARANTINED),
    Bad("hang", of(bare(SLEEPS)), "WORKER_HUNG", Step.QUARANTINED),
    Bad("hang-at-start", of(bare(HANGS_AT_START)), "WORKER_HUNG", Step.QUARANTINED),
    Bad("exit", of(bare("import os\nos._exit(3)")), "WORKER_START_FAILED", Step.QUARANTINED),
)


@pytest.fixture
async def host(tmp_path: Path) -> Any:
    make_payload(tmp_path / "good", Part("good", LAMP), payload_id=GOOD)
    async with host_in_process(tmp_path, timing=Timing(startup_s=5.0)) as host:
        host.plug(tmp_path / "good", "good")
        await host.until_step(GOOD, Step.ACTIVE)
        yield host


@pytest.mark.parametrize("bad", WAYS, ids=lambda bad: bad.id)
async def test_bad_payload_is_told_with_its_code(
    host: HostInProcess, bad: Bad, tmp_path: Path
) -> None:
    bad.write(tmp_path / "bad")
    untouched = host.workers.pids()["good"], host.snapshot.component("good")
    host.plug(tmp_path / "bad", "bad")
    record = await host.until_step(BAD, bad.step)
    assert {problem.code for problem in record.problems} == {bad.code}, record.problems
    journal = await host.catalogue.journal(subject=BAD)
    told = [problem for entry in journal for problem in entry.problems]
    assert told == list(record.problems)
    assert (host.workers.pids()["good"], host.snapshot.component("good")) == untouched
    host.pull("bad")
    await host.until_gone(BAD)
    assert host.snapshot.component("bad") is None
    host.pull("good")
    await host.until_gone(GOOD)
    assert not left_over(host.folders)


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


async def test_second_payload_with_the_same_component_is_refused(
    host: HostInProcess, tmp_path: Path
) -> None:
    make_payload(tmp_path / "bad", Part("good", LAMP), payload_id=BAD)
    host.plug(tmp_path / "bad", "bad")
    record = await host.until_step(BAD, Step.REFUSED)
    assert [problem.code for problem in record.problems] == ["COMPONENT_TAKEN"]
    assert host.snapshot.component("good") is not None


async def test_drive_without_payload_is_told_and_let_go(
    host: HostInProcess, tmp_path: Path
) -> None:
    (tmp_path / "holiday").mkdir()
    host.plug(tmp_path / "holiday", "holiday")
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
