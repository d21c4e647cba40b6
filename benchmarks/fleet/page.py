"""The page that is written of what was measured."""

from __future__ import annotations

from importlib.metadata import version

import zmq
from benchmarks import measuring
from benchmarks.fleet.host import BUSY_S
from benchmarks.fleet.measure import DEATHS, Figures, has_deaths
from benchmarks.measuring import Spread

COLUMNS = {
    "all converged: s": ("converged_s", ".2f"),
    "sent, kB per host": ("sent_kb", ",.0f"),
    "CPU ms per host": ("cpu_ms", ",.0f"),
    "RSS MB per host": ("rss_mb", ".0f"),
    "quiet: % of a core per host": ("quiet_percent", ".2f"),
    "a change reaches all: ms": ("news_ms", ".0f"),
    "its bytes": ("news_bytes", ",.0f"),
    "wrongly taken for dead": ("lost", ".0f"),
}


def page(found: dict[tuple[str, int], list[Figures]], repeats: int) -> str:
    named = {
        "mesh": "mesh, CURVE",
        "bare": "bare ZeroMQ, CURVE",
        "zenoh": "Zenoh router",
    }
    rows = []
    for (kind, hosts), figures in found.items():
        spreads = (
            format(Spread(tuple(float(getattr(one, field)) for one in figures)), style)
            for field, style in COLUMNS.values()
        )
        rows.append([str(hosts), named.get(kind, kind), *spreads])
    return f"""# Hosts that meet: mesh, bare ZeroMQ, Zenoh router

`python -m benchmarks.fleet` wrote this page. Every host is a separate process, all on this one
machine over loopback, so that {max(hosts for _, hosts in found)} hosts share what each of them
would have alone. All have started when each is given the addresses of the others; converged means
that every one has every other's catalogue (10 kB, ten entries). Bytes are those that TCP carried,
the router's included; CPU is until then, the router's and ZeroMQ's threads included. In quiet, mesh
links are pinged from both ends, every 0.3 s for up to 32 peers and every 1.8 s for 99; by way of
the router, hosts tell their state every 3 s.
Then one entry of 200 bytes changes: until the last host has it, and what the one that told it has
sent. Live hosts that were taken for dead by another are counted until the end, deaths included. The
mesh is encrypted and every host proves its key; the router's links here are not. Bare ZeroMQ is
what the mesh is made of: the same sockets and keys, each catalogue sent once over each link, and
nothing else: no host is kept out, pinged, found dead, or told again what was missed. *Simulated*
hosts share processes, so their memory and the start of an interpreter are not those of hosts.
Medians of {repeats} repeats in turn (lowest-highest).

{measuring.table(["hosts", "", *COLUMNS], rows)}

## Deaths

In the mesh, four hosts die one after the other: stopped (SIGSTOP: nothing of them is heard, and
their connections stay) or killed (SIGKILL), while the others are quiet, and while every one of
them changes an entry every {BUSY_S:.0f} s and tells all others. Seconds until the last of the
others knew.

{measuring.table(["hosts", *DEATHS], _deaths(found))}

Machine: {measuring.machine()}; libzmq {zmq.zmq_version()},
eclipse-zenoh {version("eclipse-zenoh")}.
"""


def _deaths(found: dict[tuple[str, int], list[Figures]]) -> list[list[str]]:
    return [
        [
            str(hosts),
            *(format(Spread(tuple(one.deaths_s[what] for one in some)), ".2f") for what in DEATHS),
        ]
        for (kind, hosts), some in found.items()
        if has_deaths(kind, hosts)
    ]
