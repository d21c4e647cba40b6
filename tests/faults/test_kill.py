"""The daemon is killed at every commit of every transition, and comes back consistent by itself."""

from __future__ import annotations

import asyncio
import json
import random
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.host.lifecycle.living import LAMP, Living, left_over, living
from tests.payloads import Part, make_payload, seal, sha256

from nondum.host import events
from nondum.host.catalogue.records import Step
from nondum.host.events import Event
from nondum.host.lifecycle.folders import Folders
from nondum.host.lifecycle.recovery import ATTEMPTS
from nondum.host.transitions import TRANSITIONS
from nondum.host.workers import Timing
from nondum.sdk.description import PluginDescription

pytestmark = [pytest.mark.anyio, pytest.mark.slow]

ROOT = Path(__file__).parent.parent.parent
LAMP_ID = "org.example.lamp"
NOTHING = PluginDescription(name="test-lamp", version="1.0")
DEAD_S = 60.0


# Payloads that come to each step, and how they end when they are left alone


def sound(drive: Path) -> None:
    make_payload(drive, Part("lamp", LAMP), payload_id=LAMP_ID)


def unfit(drive: Path) -> None:
    """Refused from its metadata, while it is copied."""
    lamp = Part("lamp", LAMP)
    make_payload(drive, lamp, payload_id=LAMP_ID, requires='python = ">=3.99"')


def hooked(drive: Path) -> None:
    """Refused when its wheels are checked."""
    lamp = Part("lamp", LAMP, files={"hook.pth": "import os\n"})
    make_payload(drive, lamp, payload_id=LAMP_ID)


def unstageable(drive: Path) -> None:
    """Refused when it is staged: there is a file where the folder of payloads should be."""
    sound(drive)
    state = drive.parent / "state"
    state.mkdir()
    (state / "payloads").touch()


def damaged(drive: Path) -> None:
    """Refused when it is unpacked: a file of a wheel is not what its RECORD says."""
    folder = make_payload(drive, Part("lamp", LAMP), payload_id=LAMP_ID)
    wheel = next((folder / "wheels").glob("test_lamp-*.whl"))
    before = sha256(wheel)
    data = bytearray(wheel.read_bytes())
    data[50] ^= 0xFF  # inside the first member's compressed bytes
    wheel.write_bytes(data)
    lock = folder / "pylock.lamp.toml"
    lock.write_text(lock.read_text().replace(before, sha256(wheel)))
    seal(folder, payload_id=LAMP_ID)


def broken(drive: Path) -> None:
    """Quarantined: its plugin cannot be imported."""
    lamp = Part("lamp", "import no_such_module", description=NOTHING)
    make_payload(drive, lamp, payload_id=LAMP_ID)


Write = Callable[[Path], None]

ENDS: dict[Write, Step] = {
    sound: Step.ACTIVE,
    unfit: Step.REFUSED,
    hooked: Step.REFUSED,
    unstageable: Step.REFUSED,
    damaged: Step.REFUSED,
    broken: Step.QUARANTINED,
}

LASTING = {events.PayloadFailed: Step.QUARANTINED, events.PayloadSentAway: Step.REFUSED}
"""Where these leave a payload, however it would have ended."""

REFUSED_AT: dict[Step, Write] = {
    Step.RECEIVED: unfit,
    Step.COPIED: hooked,
    Step.VERIFIED: unstageable,
    Step.STAGED: damaged,
}


def way(step: Step, event: type[Event]) -> tuple[Write, tuple[str, str] | None]:
    """A payload that comes to `step`, and the nudge that makes `event` happen there."""
    comes = {Step.REFUSED: unfit, Step.QUARANTINED: broken}.get(step, sound)
    if event is events.PayloadWithdrawn:
        return comes, (step.name, "pull")
    if event is events.PayloadSentAway:
        return comes, (step.name, "send")
    if event is events.RetryAsked:
        return comes, (step.name, "retry")
    if event is events.PayloadRefused:
        return REFUSED_AT[step], None
    if event is events.PayloadFailed:
        return (broken, None) if step is Step.STORED else (sound, (step.name, "lost"))
    if event is events.PayloadCleared:
        return sound, (Step.ACTIVE.name, "pull")
    return sound, None


def run_until_dead(root: Path, **orders: Any) -> None:
    """Run a daemon that kills itself."""
    command = [
        sys.executable,
        "-m",
        "tests.faults.daemon",
        json.dumps({"root": str(root), **orders}),
    ]
    ended = subprocess.run(command, cwd=ROOT, timeout=DEAD_S, check=False)
    assert ended.returncode == -9, "it was not killed: the transition never happened"


def processes_of(folder: Path) -> list[str]:
    """Processes whose environment names a folder, as that of workers names their scratch."""
    found = []
    for process in Path("/proc").iterdir():
        if not process.name.isdigit():
            continue
        try:
            said = (process / "environ").read_bytes()
        except OSError:
            continue
        if str(folder).encode() in said:
            found.append((process / "cmdline").read_text().replace("\0", " "))
    return found


async def check_recovery(root: Path, end: Step) -> None:
    """A new daemon brings things to their end, and leaves nothing behind when told to."""
    async with living(root, timing=Timing(startup_s=2.0)) as host:
        if plugged(host):
            await host.until_step(LAMP_ID, end)
            host.pull()
        await host.until_gone(LAMP_ID)
        assert not host.snapshot.components
        assert not left_over(host.folders)
        (state,) = {host.folders.root}
    with sqlite3.connect(Folders(state).catalogue) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
    connection.close()
    assert not list((state / "store").glob(".*"))
    assert not processes_of(state)


def plugged(host: Living) -> bool:
    return (host.slots / "a").is_symlink()


def plug(root: Path, write: Write) -> None:
    write(root / "drive")
    (root / "slots").mkdir()
    (root / "slots/a").symlink_to(root / "drive")


@pytest.mark.parametrize("when", ["BEFORE", "AFTER"])
@pytest.mark.parametrize(
    ("step", "event"), TRANSITIONS, ids=lambda value: getattr(value, "__name__", str(value))
)
async def test_kill_at_a_transition(
    tmp_path: Path, step: Step, event: type[Event], when: str
) -> None:
    write, nudge = way(step, event)
    plug(tmp_path, write)
    orders: dict[str, Any] = {"kill": (when, step.name, event.__name__)}
    if nudge is not None:
        orders["nudge"] = nudge
    await asyncio.to_thread(run_until_dead, tmp_path, **orders)
    lasts = LASTING.get(event) if when == "AFTER" else None
    await check_recovery(tmp_path, lasts or ENDS[write])


async def test_kill_at_any_moment(tmp_path: Path) -> None:
    plug(tmp_path, sound)
    moments = random.Random(7)
    command = [sys.executable, "-m", "tests.faults.daemon", json.dumps({"root": str(tmp_path)})]
    for _ in range(12):
        daemon = await asyncio.create_subprocess_exec(*command, cwd=ROOT)
        await asyncio.sleep(moments.uniform(0.3, 1.5))
        daemon.kill()
        await daemon.wait()
    await check_recovery(tmp_path, Step.ACTIVE)


async def test_payload_that_takes_the_daemon_along_is_quarantined(tmp_path: Path) -> None:
    plug(tmp_path, sound)
    orders = {"kill": ("BEFORE", "STORED", "ComponentsProbed")}
    for _ in range(ATTEMPTS + 1):
        await asyncio.to_thread(run_until_dead, tmp_path, **orders)
    async with living(tmp_path) as host:
        record = await host.until_step(LAMP_ID, Step.QUARANTINED)
        assert [problem.code for problem in record.problems] == ["QUARANTINED"]
        host.bus.emit(events.RetryAsked(record.key))
        await host.until(lambda: host.snapshot.component("lamp") is not None)
