"""A sandboxed hostile plugin that tries everything reaches nothing."""

from __future__ import annotations

import io
import json
import tarfile
from pathlib import Path

from tests.lab.lab import Lab

CHECKOUT = Path(__file__).parents[3]
PARTS = (
    *("tests/sandbox/baits.py", "tests/sandbox/escape.py", "tests/sandbox/table.py"),
    *("tests/kit/clock.py", "tests/kit/processes.py", "tests/kit/until.py", "tests/kit/workers.py"),
    *("demo/robot.py", "plugins/sdk/nondum"),
)
PLACE = "/var/lib/checkout"
PROGRAM = """
import asyncio, json, shutil
from tests.sandbox.table import column
from nondum.host.workers.boxed import Boxed

print(json.dumps(asyncio.run(column(Boxed(shutil.which("bwrap"))))))
"""


def run(lab: Lab) -> str:
    """Run it as root's, where every bait is to be had."""
    machine = lab.booted_once().machine
    machine.put(f"{PLACE}.tar", packed())
    machine.put(f"{PLACE}/tried.py", PROGRAM)
    machine.run(f"tar -C {PLACE} -xf {PLACE}.tar")
    said = machine.run(
        "systemd-run --quiet --pipe --wait -p 'Delegate=memory pids cpu' "
        f"-E PYTHONPATH={PLACE} /opt/nondum/bin/python {PLACE}/tried.py",
        timeout_s=600,
    )
    results = json.loads(said)
    reached = sorted(name for name, could in results.items() if could)
    assert not reached, f"reached: {reached}"
    return f"{len(results)} attempts"


def packed() -> bytes:
    """What the guest needs of this checkout."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as archive:
        for part in PARTS:
            archive.add(CHECKOUT / part, part, filter=_without_caches)
    return buffer.getvalue()


def _without_caches(info: tarfile.TarInfo) -> tarfile.TarInfo | None:
    return None if "__pycache__" in info.name else info
