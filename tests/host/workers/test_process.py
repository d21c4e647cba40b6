"""A worker's process is ended, and its end is told, also where the host cannot watch all of it."""

from __future__ import annotations

import errno
import json
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from tests.kit.descriptors import descriptors_left, open_descriptors
from tests.kit.processes import is_alive
from tests.kit.watches import watches_left

from nondum.host.workers.init_link import InitLink
from nondum.host.workers.process import WorkerProcess

pytestmark = pytest.mark.anyio


@contextmanager
def sleeper() -> Iterator[subprocess.Popen[bytes]]:
    """A stand-in for the process that makes a worker's sandbox."""
    with subprocess.Popen(["sleep", "600"], start_new_session=True) as popen:
        try:
            yield popen
        finally:
            popen.kill()


@contextmanager
def identified_init() -> Iterator[InitLink]:
    """One that is this very process, and never ends before the worker."""
    orders, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    orders.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
    with theirs:
        theirs.send(json.dumps({"is": "init"}).encode())
        init = InitLink(orders)
        try:
            yield init
        finally:
            init.close()


async def test_worker_is_ended_where_no_descriptor_is_left_for_its_init() -> None:
    with sleeper() as popen, identified_init() as init:
        process = WorkerProcess(popen, init=init)
        with descriptors_left(0):
            assert await process.end(0.0)
        assert process.exited.result() == -signal.SIGKILL
        assert not is_alive(popen.pid)


async def test_end_is_told_where_that_of_the_sandbox_cannot_be_watched() -> None:
    before = open_descriptors()
    with sleeper() as popen, identified_init() as init:
        process = WorkerProcess(popen, init=init)
        assert process.pid == popen.pid, "only its init has said who it is by now, no worker"
        with watches_left(0):
            assert await process.end(0.0)
        assert process.exited.result() == -signal.SIGKILL
    assert open_descriptors() == before


async def test_process_that_cannot_be_watched_leaves_no_descriptor_open() -> None:
    with sleeper() as popen:
        before = open_descriptors()
        with watches_left(0), pytest.raises(OSError) as failed:
            WorkerProcess(popen)
        assert failed.value.errno == errno.ENOSPC
        assert open_descriptors() == before
