"""The command: `python -m benchmarks.footprint`, from the root of the checkout."""

from __future__ import annotations

import argparse
import os
import platform
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.footprint import probe, report, results
from benchmarks.recompose.processes import await_rest
from tests.lab.plugins import talker
from tests.payloads import make_payload

PATIENCE_S = 300.0
STARTS = 3
CONFIGURATION = """
[host]
name = "rover"
state = "{folder}/state"
control = "{folder}/control"
[drives]
slots = ["{folder}/slots"]
allow_unsigned = true
[peers]
enabled = true
listen = ["tcp://127.0.0.1:0"]
"""
SETTLED_S = 60.0
"""After a start: half a minute later it is written that nothing went wrong."""
PAYLOAD = "org.example.talker"


def main() -> None:
    """Measure this machine, keep what was found, and write the page."""
    seconds = _arguments().seconds
    with tempfile.TemporaryDirectory(prefix="nondum-") as name:
        folder = Path(name)
        (folder / "host.toml").write_text(CONFIGURATION.format(folder=folder), encoding="utf-8")
        starts = []
        for _ in range(STARTS - 1):
            with _host(folder) as (_, start_s):
                starts.append(start_s)
        with _host(folder) as (pid, start_s):
            time.sleep(SETTLED_S)
            await_rest(pid, timeout_s=PATIENCE_S)
            idle = probe.look(pid, seconds)
            make_payload(folder / "stick", talker(), payload_id=PAYLOAD)
            (folder / "stick").rename(folder / "slots/stick")
            _await_worker(pid)
            await_rest(pid, timeout_s=PATIENCE_S)
            with_worker = probe.memory(pid)
        found = results.Footprint(
            machine=f"{platform.machine()}, {os.cpu_count()} processors",
            is_emulated=False,
            start_s=min(*starts, start_s),
            yardstick_s=probe.yardstick(),
            idle=idle,
            with_worker=with_worker,
        )
    results.keep(f"here-{platform.machine()}", found)
    print(report.write())


@contextmanager
def _host(folder: Path) -> Iterator[tuple[int, float]]:
    """A host that has said that it is ready: its process, and how long that took."""
    ready = folder / "ready"
    ready.unlink(missing_ok=True)
    command = [sys.executable, "-m", "nondum.host.cli", "host", "run", "--user"]
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


def _await_worker(pid: int) -> None:
    """Wait until there are two workers: that of the payload, and the spare."""
    until = time.monotonic() + PATIENCE_S
    while len(probe.memory(pid).get("worker", [])) < 2:
        if time.monotonic() > until:
            raise TimeoutError("the payload has no worker")
        time.sleep(0.2)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=120.0, help="how long it is watched [120]")
    return parser.parse_args()


if __name__ == "__main__":
    main()
