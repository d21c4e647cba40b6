"""Hosts that meet and read each other: `python -m benchmarks.fleet`.

Every host is a separate process, all on this machine over loopback: by mesh (CURVE, every host
linked to every other), by bare ZeroMQ sockets that are linked in the same way (CURVE, too), and by
way of a Zenoh router (a process more, no encryption). All start, and wait; then each is given the
addresses of the others. Measured until every one of them has every other's catalogue of 10 kB; then
for some seconds of quiet, and one change that all must hear of. In the mesh, hosts are then stopped
and killed, while all are quiet and while all tell changes: how long until all others know, and
whether a live one was taken for dead meanwhile.
Writes docs/benchmarks/fleet.md.
"""

from __future__ import annotations

import argparse
import sys

from benchmarks import measuring
from benchmarks.fleet.measure import Figures, measure
from benchmarks.fleet.page import page

TOGETHER = 25
SIMULATED = f"this number of hosts more, by way of the router, {TOGETHER} in each process; once"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--hosts", type=int, nargs="+", default=[2, 32, 100])
    parser.add_argument("--kinds", nargs="+", default=["mesh", "bare", "zenoh"])
    parser.add_argument("--simulated", type=int, nargs="*", default=[], help=SIMULATED)
    arguments = parser.parse_args()
    found: dict[tuple[str, int], list[Figures]] = {}
    for hosts in arguments.hosts:
        for _ in range(arguments.repeats):
            for kind in arguments.kinds:
                figures = measure(kind, hosts)
                print(kind, hosts, figures, file=sys.stderr, flush=True)
                found.setdefault((kind, hosts), []).append(figures)
    for hosts in arguments.simulated:
        figures = measure("zenoh", hosts, TOGETHER)
        print(hosts, f"in {hosts // TOGETHER} processes", figures, file=sys.stderr, flush=True)
        found[f"Zenoh router, *simulated*: {TOGETHER} hosts a process", hosts] = [figures]
    measuring.write("fleet", page(found, arguments.repeats))


if __name__ == "__main__":
    main()
