"""A hostile plugin that tries everything reaches nothing at level 3, nor at level 2."""

from __future__ import annotations

import io
import json
import tarfile
from pathlib import Path

from tests.lab.cache import cache_folder
from tests.lab.lab import Lab

CHECKOUT = Path(__file__).parents[3]
PARTS = (
    *("tests/confinement/baits.py", "tests/confinement/escape.py", "tests/confinement/table.py"),
    *("tests/kit/until.py", "tests/kit/workers.py", "demo/robot.py", "plugins/sdk/nondum"),
)
PLACE = "/var/lib/checkout"
PROGRAM = """
import asyncio, json, shutil
from tests.confinement.table import column
from nondum.host.confinement.systemd_service import Served
from nondum.host.workers.confinements import Boxed

async def tried():
    return {"2": await column(Served()), "3": await column(Boxed(shutil.which("bwrap")))}

print(json.dumps(asyncio.run(tried())))
"""
RESULTS = "escape.json"
LEFT_AT_2 = frozenset({"know the host name"})
"""A service may have a host name of its own, but no other one."""


def run(lab: Lab) -> str:
    """Run it as root's, where every bait is to be had; keep what it reached for the docs."""
    machine = lab.booted_once().machine
    machine.put(f"{PLACE}.tar", packed())
    machine.put(f"{PLACE}/tried.py", PROGRAM)
    machine.run(f"tar -C {PLACE} -xf {PLACE}.tar")
    said = machine.run(
        "systemd-run --quiet --pipe --wait -p 'Delegate=memory pids cpu' "
        f"-E PYTHONPATH={PLACE} /opt/nondum/bin/python {PLACE}/tried.py",
        timeout_s=600,
    )
    columns = json.loads(said)
    (cache_folder() / RESULTS).write_text(json.dumps(columns, indent=1), encoding="utf-8")
    reached = {level: {n for n, could in each.items() if could} for level, each in columns.items()}
    assert reached["3"] == set(), f"level 3: {sorted(reached['3'])}"
    assert reached["2"] <= LEFT_AT_2, f"level 2: {sorted(reached['2'])}"
    return f"{len(columns['3'])} attempts; level 3: none, level 2: {len(reached['2'])}"


def packed() -> bytes:
    """What the guest needs of this checkout."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w") as archive:
        for part in PARTS:
            archive.add(CHECKOUT / part, part, filter=_without_caches)
    return buffer.getvalue()


def _without_caches(info: tarfile.TarInfo) -> tarfile.TarInfo | None:
    return None if "__pycache__" in info.name else info
