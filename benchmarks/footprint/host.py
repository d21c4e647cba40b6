"""A host on this machine, measured: a user's, with slots, and with peers as a service has them."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.footprint import probe

PATIENCE_S = 300.0
CONFIGURATION = """
[host]
name = "rover"
state = "{folder}/state"
control = "{folder}/control"
keep_ready_above_mb = {ready_above_mb}
[drives]
slots = ["{folder}/slots"]
allow_unsigned = true
[peers]
enabled = true
listen = ["tcp://127.0.0.1:0"]
process = {process}
"""


@contextmanager
def running(
    folder: Path, *, apart: bool = False, ready_above_mb: int = 0
) -> Iterator[tuple[int, float]]:
    """A host that has said that it is ready (sd_notify(3)): its process, and how many seconds that
    took. `folder` has a short path (unix(7)), and keeps its state from one to the next; `apart`
    puts the links to peers into a separate process; `ready_above_mb`: see docs/configuration.md."""
    ready = folder / "ready"
    ready.unlink(missing_ok=True)
    configuration = CONFIGURATION.format(
        folder=folder, process=str(apart).lower(), ready_above_mb=ready_above_mb
    )
    (folder / "host.toml").write_text(configuration, encoding="utf-8")
    command = [sys.executable, "-m", "nondum.cli", "host", "run", "--user"]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as told:
        told.bind(str(ready))
        told.settimeout(PATIENCE_S)
        began = time.monotonic()
        process = subprocess.Popen(
            [*command, "--config", folder / "host.toml"],
            env={**os.environ, "NOTIFY_SOCKET": str(ready)},
            stderr=subprocess.DEVNULL,
        )
        try:
            while b"READY=1" not in told.recv(4096):
                pass
            yield process.pid, time.monotonic() - began
        finally:
            process.terminate()
            process.wait()


def await_worker(pid: int) -> None:
    """Wait until there are two workers: that of the payload, and the spare.

    Raises `TimeoutError`.
    """
    until = time.monotonic() + PATIENCE_S
    while len(probe.memory(pid).get("worker", [])) < 2:
        if time.monotonic() > until:
            raise TimeoutError("the payload has no worker")
        time.sleep(0.2)
