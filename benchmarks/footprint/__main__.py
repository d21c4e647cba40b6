"""The command: `python -m benchmarks.footprint`, from the root of the checkout."""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.footprint import probe, report, results
from benchmarks.footprint.host import PATIENCE_S, await_worker, running
from benchmarks.recompose.processes import await_rest
from tests.daemon.plugins import talker
from tests.kit.payloads import make_payload

PACKAGES = (
    "asyncio, ifaddr, importlib_metadata, lark, msgpack, packaging, pluggy, py_trees, pyudev, "
    "sqlite3, ssl, zmq"
)
"""What a daemon imports that is not nondum's."""
STARTS = 3
SETTLED_S = 60.0
"""After a start: half a minute later it is written that nothing went wrong."""


def main() -> None:
    """Measure this machine, keep what was found, and write the page."""
    seconds = _arguments().seconds
    with tempfile.TemporaryDirectory(prefix="nondum-") as name:
        found = _measured(Path(name), seconds)
    results.keep(f"here-{platform.machine()}", found)
    print(report.write())


def _measured(folder: Path, seconds: float) -> results.Footprint:
    starts = [_start(folder) for _ in range(STARTS)]
    with running(folder) as (pid, _):
        time.sleep(SETTLED_S)
        await_rest(pid, timeout_s=PATIENCE_S)
        idle = probe.look(pid, seconds)
        make_payload(folder / "stick", talker())
        (folder / "stick").rename(folder / "slots/stick")
        await_worker(pid)
        await_rest(pid, timeout_s=PATIENCE_S)
        with_worker = probe.memory(pid)
    return results.Footprint(
        apart=_apart(folder),
        machine=f"{platform.machine()}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.0f}",
        is_emulated=False,
        start_s=min(elapsed_s for elapsed_s, _ in starts),
        start_cpu_s=min(cpu_s for _, cpu_s in starts),
        yardstick_s=probe.yardstick(),
        idle=idle,
        with_worker=with_worker,
        packages_kb=_packages_kb(),
    )


def _apart(folder: Path) -> dict[str, list[int]]:
    """Memory of a host that keeps its links to peers in a separate process."""
    (folder / "slots/stick").rename(folder / "stick")
    with running(folder, apart=True) as (pid, _):
        time.sleep(SETTLED_S)
        await_rest(pid, timeout_s=PATIENCE_S)
        return probe.memory(pid)


def _packages_kb() -> int:
    """Proportional set size of an interpreter that has imported `PACKAGES`."""
    command = [sys.executable, "-I", "-c", f"import {PACKAGES}; print(flush=True); input()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        found = probe.pss_kb(process.pid)
        process.kill()
    return found


def _start(folder: Path) -> tuple[float, float]:
    """Seconds until it was ready, and what it took of a processor until then."""
    with running(folder) as (pid, start_s):
        return start_s, probe.processor_s(pid)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=120.0, help="how long it is watched [120]")
    return parser.parse_args()


if __name__ == "__main__":
    main()
