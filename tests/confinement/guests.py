"""Workers that do one thing, in whatever holds them, and how they look from outside."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from tests.kit.workers import HOST, WorkersUnderTest

from nondum.planning.running import RunState
from nondum.sdk.description import Behaviour, Unit

DO = Behaviour("do", "(do ?u - sensor)")
PLUGIN = """
import os, shutil, socket, subprocess, sys, tty
from nondum.sdk import Unit, behaviour, hookimpl

@hookimpl
def units():
    return (Unit("it", "sensor"),)

@behaviour("do", action="(do ?u - sensor)")
async def do(ctx, u):
    device = ctx.device("line")
    {body}
"""


async def guest(tested: WorkersUnderTest, body: str, permissions: tuple[str, ...] = ()) -> None:
    source = PLUGIN.replace("{body}", body.replace("\n", "\n    "))
    spec = tested.spec("guest", source, behaviours=(DO,), units=(Unit("it", "sensor"),))
    await tested.workers.start(replace(spec, permissions=permissions))


async def does(tested: WorkersUnderTest) -> str:
    """Have it do its thing; why it failed, if so."""
    call = tested.behave("guest", "do", u=f"{HOST}__guest__it")
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
