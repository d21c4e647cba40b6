"""Has hosts meet, tell and die, and measures how long that takes."""

from __future__ import annotations

import contextlib
import math
import signal
import socket
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmarks.fleet.children import Child, children

from nondum.transport.peers import HostKeys

QUIET_S = 4.0
SEEN_S = 1.0
"""Between two looks whether a death is known to all …"""
PATIENCE_S = 20.0
"""… until so much later."""


@dataclass(frozen=True, slots=True)
class Figures:
    """One repeat."""

    converged_s: float
    sent_kb: float
    """By all together, per host."""
    cpu_ms: float
    """Per host, its part of the router's included."""
    rss_mb: float
    quiet_percent: float
    """Of a core, per host."""
    news_ms: float
    news_bytes: float
    """That the host with the news has sent meanwhile."""
    lost: int
    """Live peers that were taken for dead, in all."""
    why: dict[str, int]
    """The reasons that were told for them."""
    deaths_s: dict[str, float]
    """By what happened: until the last host knew that another was dead."""


DEATHS = {
    "quiet, stopped": (False, signal.SIGSTOP),
    "quiet, killed": (False, signal.SIGKILL),
    "busy, stopped": (True, signal.SIGSTOP),
    "busy, killed": (True, signal.SIGKILL),
}


def strike(nodes: list[Child]) -> tuple[dict[str, float], set[str], list[dict[str, Any]]]:
    """Have hosts die, one after the other; how long until all others knew, which ones died, and
    what the others told at the end."""
    took_s, dead, alive = {}, set(), list(nodes)
    is_busy = False
    for what, (wants_busy, number) in DEATHS.items():
        if wants_busy is not is_busy:
            for node in alive:
                node.order("be busy")
            is_busy = True
            time.sleep(QUIET_S)
        struck = alive.pop()
        at_s = time.monotonic()
        struck.process.send_signal(number)
        dead.add(struck.name)
        took_s[what] = max(_known_to(node, struck.name, at_s) for node in alive)
    time.sleep(QUIET_S)
    for node in alive:
        node.order("rest")
    return took_s, dead, _all(alive, lambda node: node.order("look"))


def has_deaths(kind: str, hosts: int) -> bool:
    return kind == "mesh" and hosts > len(DEATHS) + 1


def _known_to(node: Child, name: str, at_s: float) -> float:
    """How long after a moment a host lost another; infinite when it did not."""
    while True:
        node.order("look")
        for lost_s, lost, _ in node.answer()["lost"]:
            if lost == name and lost_s >= at_s:
                return float(lost_s) - at_s
        if time.monotonic() - at_s > PATIENCE_S:
            return math.inf
        time.sleep(SEEN_S)


def measure(kind: str, hosts: int, together: int = 1) -> Figures:
    """One repeat, with this number of hosts `together` in each process."""
    keys = [HostKeys.generate() for _ in range(hosts)]
    trusted = {pair.public: f"host-{number}" for number, pair in enumerate(keys)}
    with socket.create_server(("127.0.0.1", 0)) as free:
        router = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    configs = [
        {
            "name": trusted[pair.public],
            "public": pair.public,
            "secret": pair.secret,
            "trusted": trusted,
            "router": router,
        }
        for pair in keys
    ]
    processes = [(kind, configs[at : at + together]) for at in range(0, hosts, together)]
    with contextlib.ExitStack() as stack:
        relays = []
        if kind == "zenoh":
            relays = stack.enter_context(children([("router", router)]))
        nodes = stack.enter_context(children(processes))
        addresses = [address for node in nodes for address in node.addresses]
        places = {pair.public: at for pair, at in zip(keys, addresses, strict=True)}
        everybody = [*nodes, *relays]
        before = _all(everybody, lambda node: node.order("look"))
        begun_s = time.monotonic()
        for node in nodes:
            node.order("meet", places=places)
        met = [node.answer() for node in nodes]
        after = _all(everybody, lambda node: node.order("look"))
        time.sleep(QUIET_S)
        quiet = _all(everybody, lambda node: node.order("look"))
        for node in nodes[1:]:
            node.order("hear")
        told_s = time.monotonic()
        nodes[0].order("publish")
        heard = [node.answer() for node in nodes[1:]]
        nodes[0].order("look")
        publisher = nodes[0].answer()
        silence = (quiet[0]["sent"] - after[0]["sent"]) / (quiet[0]["at_s"] - after[0]["at_s"])
        took_s, dead, last = (
            strike(nodes) if has_deaths(kind, hosts) else ({}, set(), quiet[: len(nodes)])
        )
        why = Counter(why for one in last for _, name, why in one["lost"] if name not in dead)
        noise = silence * (publisher["at_s"] - quiet[0]["at_s"])
        return Figures(
            converged_s=max(one["at_s"] for one in met) - begun_s,
            sent_kb=_grown("sent", before, after) / hosts / 1000,
            cpu_ms=_grown("cpu_s", before, after) / hosts * 1000,
            rss_mb=sum(one["rss_mb"] for one in after[: len(nodes)]) / hosts,
            quiet_percent=100
            * _grown("cpu_s", after, quiet)
            / hosts
            / (quiet[0]["at_s"] - after[0]["at_s"]),
            news_ms=(max(one["at_s"] for one in heard) - told_s) * 1000,
            news_bytes=publisher["sent"] - quiet[0]["sent"] - noise,
            lost=why.total(),
            why=dict(why),
            deaths_s=took_s,
        )


def _all(nodes: list[Child], order: Callable[[Child], None]) -> list[dict[str, Any]]:
    for node in nodes:
        order(node)
    return [node.answer() for node in nodes]


def _grown(field: str, before: list[dict[str, Any]], after: list[dict[str, Any]]) -> float:
    pairs = zip(before, after, strict=True)
    return float(sum(late[field] - early[field] for early, late in pairs))
