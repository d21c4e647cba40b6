"""The bench of recomposition runs beside podman in one machine (benchmarks/recompose)."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.lab.building import Built, make_disk
from tests.lab.cache import call
from tests.lab.lab import Lab
from tests.lab.podman import podman_debs
from tests.lab.software import CHECKOUT

ROUNDS = 2
PAYLOAD = "small"
"""The big one loads hundreds of megabytes into an emulated machine: half an hour a round."""
WORK = CHECKOUT / "build/benchmarks/recompose"
SLACK_MB = 150
MEASURING_S = 5400.0
SOURCES = ("benchmarks", "demo")
INSTALL = (
    "dpkg -i /mnt/debs/*.deb && modprobe overlay && mkdir -p /bench && cp -r /mnt/work /bench/"
)
MEASURE = """
cd /bench && PYTHONPATH=/mnt/sources /opt/nondum/bin/python -m benchmarks.recompose --prepared \
    --rounds {rounds} --payload {payload} --work /bench/work --output /bench/page.md \
    --note '**emulated** by QEMU without KVM: only the ratios say something'
"""


def run(lab: Lab) -> str:
    """Build payload and image outside, measure both inside; answers the ratios."""
    disk = _disk(lab.built, lab.work)
    machine = lab.bare(lab.software, disk)
    machine.run("mkdir -p /opt/nondum && mount -o ro /dev/vdb /opt/nondum")
    machine.run("mount -o ro /dev/vdc /mnt")
    machine.run(INSTALL, timeout_s=MEASURING_S)
    machine.run(MEASURE.format(rounds=ROUNDS, payload=PAYLOAD), timeout_s=MEASURING_S)
    page = machine.run("cat /bench/page.md")
    name = f"docs/benchmarks/recompose-{lab.built.recipe.name}-emulated.md"
    if lab.is_alone:
        (CHECKOUT / name).write_text(page, encoding="utf-8")
    rows = [row.split("|") for row in page.splitlines() if row.startswith(f"| {PAYLOAD} ")]
    ratios = [f"{row[2].strip()} ÷ load {row[4].strip()}" for row in rows if "nondum" in row[2]]
    assert ratios, "the page has no ratios"
    return "; ".join(ratios[:2])


def _disk(machine: Built, work: Path) -> Path:
    """An image with podman's packages, what is measured, and what measures."""
    bench = ("-m", "benchmarks.recompose", "--prepare", "--payload", PAYLOAD, "--work", WORK)
    call(sys.executable, *bench, env={"PYTHONPATH": str(CHECKOUT)})
    tree = work / "bench"
    call("mkdir", "-p", tree / "sources", tree / "work")
    call("cp", "-r", podman_debs(machine), tree / "debs")
    call("cp", "-r", *(CHECKOUT / name for name in SOURCES), tree / "sources")
    made = [WORK / f"drive-{PAYLOAD}", *WORK.glob(f"image-{PAYLOAD}-*")]
    call("cp", "-r", *made, tree / "work")
    size_mb = int(call("du", "-sm", tree).split()[0])
    make_disk(tree, work / "bench.img", size_mb + SLACK_MB, label="bench")
    return work / "bench.img"
