"""An interpreter that waits to become a worker, without a sandbox around it."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest
from tests.kit.processes import until_gone

from nondum.host.sandbox.levels.bubblewrap import INSIDE

pytestmark = pytest.mark.anyio
HOST = """
import os, subprocess, sys
orders = sys.argv[2]
command = [sys.executable, "-I", "-S", "-B", "-u", sys.argv[1], orders, str(os.getpid())]
spare = subprocess.Popen(command, pass_fds=[int(orders)])
print(spare.pid, flush=True)
sys.stdin.read()
spare.wait()
sys.exit(spare.returncode)
"""


@contextlib.contextmanager
def spare() -> Iterator[tuple[subprocess.Popen[str], socket.socket, int]]:
    """A host with a spare interpreter, whose orders are another process's; and its process id."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    words = [sys.executable, "-c", HOST, str(INSIDE / "bootstrap.py"), str(theirs.fileno())]
    pipe = subprocess.PIPE
    with (
        ours,
        subprocess.Popen(
            words, pass_fds=[theirs.fileno()], stdin=pipe, stdout=pipe, stderr=pipe, text=True
        ) as host,
    ):
        theirs.close()
        assert host.stdout is not None
        try:
            yield host, ours, int(host.stdout.readline())
        finally:
            host.kill()


async def test_spare_ends_with_its_host_though_its_orders_stay_open() -> None:
    with spare() as (host, _, pid):
        host.kill()
        await until_gone(pid)


def test_spare_that_is_not_needed_ends_in_silence() -> None:
    with spare() as (host, orders, _):
        orders.close()
        _, said = host.communicate()
        assert (host.returncode, said) == (0, "")
