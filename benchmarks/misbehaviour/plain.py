"""The same misbehaviour by a plain process that no host looks after, with the same limits: what is
left of it among the good workers is this machine's kernel, not nondum."""

from __future__ import annotations

import asyncio
import contextlib
import os
import resource
import shutil
import subprocess
from collections.abc import AsyncIterator
from pathlib import Path

from benchmarks.misbehaviour.scene import LIBRARIES, LIMITS
from benchmarks.misbehaviour.ways import Way

from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.workers.spec import base_interpreter

SOURCE = """
import asyncio, os, signal, socket, sys, threading, time

def link():
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    if os.fork() == 0:
        ours.close()
        while theirs.recv(1 << 16):
            pass
        os._exit(0)
    theirs.close()
    return ours

async def do():
    {body}

print("ready", flush=True)
sys.stdin.readline()
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
asyncio.run(do())
signal.pause()
"""


@contextlib.asynccontextmanager
async def plain(way: Way, folder: Path, cgroups: Cgroups) -> AsyncIterator[subprocess.Popen[bytes]]:
    """A process that misbehaves as soon as it reads a line; ended with all its children."""
    await asyncio.to_thread(folder.mkdir)
    cgroup = cgroups.make("plain", LIMITS.of_cgroup())
    process = await asyncio.to_thread(_started, way, folder)
    try:
        await asyncio.to_thread(cgroup.add, process.pid)
        limit = LIMITS.descriptors
        resource.prlimit(process.pid, resource.RLIMIT_NOFILE, (limit, limit))
        assert process.stdout is not None
        await asyncio.to_thread(process.stdout.readline)
        yield process
    finally:
        await asyncio.to_thread(cgroup.end)
        await asyncio.to_thread(process.communicate)
        await asyncio.to_thread(shutil.rmtree, folder)


def _started(way: Way, folder: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [base_interpreter(), "-c", SOURCE.replace("{body}", way.body.replace("\n", "\n    "))],
        cwd=folder,
        env={"PYTHONPATH": os.pathsep.join(map(str, LIBRARIES))},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
