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
    """What makes a worker's room, as it were."""
    with subprocess.Popen(["sleep", "600"], start_new_session=True) as popen:
        try:
            yield popen
        finally:
            popen.kill()


@contextmanager
def keeper_that_has_said_who_it_is() -> Iterator[InitLink]:
    """One that is this very process, and never ends before the worker."""
    orders, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    orders.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
    with theirs:
        theirs.send(json.dumps({"is": "keeper"}).encode())
        keeper = InitLink(orders)
        try:
            yield keeper
        finally:
            keeper.close()


async def test_worker_is_ended_where_no_descriptor_is_left_for_its_keeper() -> None:
    with sleeper() as popen, keeper_that_has_said_who_it_is() as keeper:
        process = WorkerProcess(popen, keeper=keeper)
        with descriptors_left(0):
            assert await process.end(0.0)
        assert process.exited.result() == -signal.SIGKILL
        assert not is_alive(popen.pid)


async def test_end_is_told_where_that_of_the_room_cannot_be_watched() -> None:
    before = open_descriptors()
    with sleeper() as popen, keeper_that_has_said_who_it_is() as keeper:
        process = WorkerProcess(popen, keeper=keeper)
        assert process.pid == popen.pid, "its keeper has been heard by now, no worker"
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
