"""Workers that do one thing, in whatever holds them, and how they look from outside."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from tests.kit.guest import do, guest_spec
from tests.kit.workers import WorkersUnderTest

from nondum.planning.execute.running import RunState


async def guest(tested: WorkersUnderTest, body: str, permissions: tuple[str, ...] = ()) -> None:
    """Start one; its `device` is what it was given as `line`."""
    spec = guest_spec(tested, f"device = ctx.device('line')\n{body}")
    await tested.workers.start(replace(spec, permissions=permissions))


async def does(tested: WorkersUnderTest) -> str:
    """Have it do its thing; why it failed, if so."""
    call = do(tested)
    return "" if await call.ended() is RunState.SUCCEEDED else call.reason


@contextlib.contextmanager
def open_folder() -> Iterator[Path]:
    """A folder that everybody may go into, unlike those of tests."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        yield folder


def status(pid: int) -> dict[str, str]:
    lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    return dict(line.split(":\t", 1) for line in lines)


def parent(pid: int) -> int:
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return int(fields[1])


def owner(path: Path) -> int:
    return path.stat().st_uid
