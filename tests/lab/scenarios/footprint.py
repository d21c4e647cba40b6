"""A host at rest takes little of its machine: memory, processor and writes to its disk."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from benchmarks.footprint import probe, report, results
from tests.daemon.plugins import talker
from tests.lab.installed import Installed
from tests.lab.lab import Lab

PROBE = Path(probe.__file__)
PAYLOAD = "org.example.talker"
SETTLED_S, WATCHED_S = 60, 90
"""The first after a start: half a minute later it is written that nothing went wrong."""
STARTS = 3
DAEMON_MB, WORKER_MB, KB_PER_HOUR = 60.0, 20.0, 2000.0
"""What may be taken; the processor's share is that of a real core, and not judged here."""
START = "systemctl start nondum && cat /proc/$(systemctl show --value -p MainPID nondum)/stat"
HERTZ = 100
"""The kernel's unit of processor time, on both architectures."""
TIMES = "systemctl show -p ExecMainStartTimestampMonotonic -p ActiveEnterTimestampMonotonic"


def run(lab: Lab) -> str:
    """Measure it alone, then with a worker; keep what was found for the page."""
    host = lab.host()
    machine, recipe = host.machine, lab.built.recipe
    machine.put("/tmp/probe.py", PROBE.read_text(encoding="utf-8"))
    starts = [_started_in(host) for _ in range(STARTS)]
    _probed(host, SETTLED_S)
    idle = _probed(host, WATCHED_S)
    stick = host.bring(lab.stick("talker", talker()), PAYLOAD)
    with_worker = _probed(host, 1)["memory_kb"]
    machine.pull(stick)
    found = results.Footprint(
        machine=f"{recipe.name}, 2 processors, *emulated*",
        is_emulated=True,
        start_s=min(wall_s for wall_s, _ in starts),
        start_cpu_s=min(cpu_s for _, cpu_s in starts),
        yardstick_s=idle.pop("yardstick_s"),
        idle=idle,
        with_worker=with_worker,
    )
    if lab.is_alone:
        results.keep(f"lab-{recipe.name}", found)
        report.write()
    assert found.daemon_mb <= DAEMON_MB, f"the daemon takes {found.daemon_mb:.1f} MB"
    assert found.worker_mb <= WORKER_MB, f"a worker takes {found.worker_mb:.1f} MB"
    written = idle["kb_written_per_hour"]
    assert written <= KB_PER_HOUR, f"{written:.0f} kB an hour are written"
    return (
        f"daemon {found.daemon_mb:.1f} MB, worker {found.worker_mb:.1f} MB, "
        f"{written:.0f} kB/h written, emulated: {idle['cpu_percent']:.1f} % processor, "
        f"start {found.start_s:.1f} s, {found.start_cpu_s / found.yardstick_s:.1f} yardsticks"
    )


def _started_in(host: Installed) -> tuple[float, float]:
    """Seconds from the start of the daemon's process to its being ready, by systemd's clock, and
    what it took of a processor until then."""
    host.stop()
    said = host.machine.run(START)
    host.wait_until_started()
    shown = host.machine.run(f"{TIMES} nondum.service").split()
    stamps = dict(line.split("=") for line in shown)
    began = int(stamps["ExecMainStartTimestampMonotonic"])
    user, system = said.rpartition(")")[2].split()[11:13]
    cpu_s = (int(user) + int(system)) / HERTZ
    return (int(stamps["ActiveEnterTimestampMonotonic"]) - began) / 1e6, cpu_s


def _probed(host: Installed, seconds: int) -> dict[str, Any]:
    """What the probe says, run with the machine's own Python as root."""
    command = f"python3 -I /tmp/probe.py {host.shown('MainPID')} {seconds}"
    found: dict[str, Any] = json.loads(host.machine.run(command))
    return found
