"""The page that a run writes, in Markdown, and its figures as JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator
from importlib.metadata import version
from importlib.util import find_spec
from textwrap import fill

import zmq
from benchmarks import measuring
from benchmarks.measuring import Spread
from benchmarks.peers import calls, presence
from benchmarks.peers.ground import Ground
from benchmarks.peers.presence import AT_ONCE, DEPARTURE, KINDS

CALL_AIM_US = 100.0
WIDTH = 100


@dataclasses.dataclass(frozen=True, slots=True)
class Results:
    """What was measured; None for a part that was not."""

    repeats: int
    calls_each: int
    load: float
    """Processes that wanted to run while the run began, over the last minute."""
    ground: Ground
    presence: presence.Found | None
    calls: calls.Found | None


def as_json(found: Results) -> str:
    """All repeats. What did not come about took null."""
    by_kind = {
        kind.name: [dataclasses.asdict(one) | {"took_s": _finite(one.took_s)} for one in samples]
        for kind, samples in (found.presence or {}).items()
    }
    by_way = {
        way: [dataclasses.asdict(one) for one in figures]
        for way, figures in (found.calls or {}).items()
    }
    whole = {"machine": measuring.machine(), "load": found.load, "ground": found.ground.described}
    return json.dumps(whole | {"presence": by_kind, "calls": by_way}, indent=2)


def as_markdown(found: Results) -> str:
    """The page."""
    return "\n\n".join(_sections(found)) + "\n"


def _sections(found: Results) -> Iterator[str]:
    yield "# Hosts that find, lose and call each other"
    yield _text(
        f"`python -m benchmarks.peers` wrote this page. {found.repeats} repeats of each, in turn; "
        "medians (lowest-highest). How a hundred hosts meet is in [fleet.md](fleet.md), streams "
        "between hosts are in [remote_streams.md](remote_streams.md)."
    )
    if found.presence is not None:
        yield from _presence(found.presence, found.ground)
    if found.calls is not None:
        yield from _calls(found.calls, found.calls_each)
    yield "## Machine"
    yield _text(
        f"{measuring.machine()}; load average {found.load:.1f} when the run began. {_libraries()}."
    )


def _presence(found: presence.Found, ground: Ground) -> Iterator[str]:
    yield "## Presence"
    yield _text(
        f"Real processes, {ground.described}: mesh and discovery as a daemon has them (multicast, "
        "CURVE keys, pings every 0.3 s), without what else it does. Fault and event are read from "
        "one clock."
    )
    rows = [
        [
            kind.name,
            format(Spread(tuple(one.took_s * 1000 for one in samples)), ",.0f"),
            f"{kind.aim_s * 1000:,.0f}",
            f"{len(samples) - kind.late(samples)} of {len(samples)}",
            ", ".join(sorted({one.told for one in samples})),
        ]
        for kind, samples in found.items()
    ]
    yield measuring.table(["", "ms", "aim: at most", "within it", "told as"], rows)
    starting = Spread(
        tuple(one.starting_s * 1000 for some in found.values() for one in some if one.starting_s)
    )
    yield _list(
        "**Found** begins when discovery has started at the last of them, and ends when all have "
        f"each other as peers that can be called. Before that, it took {starting:.0f} ms to start. "
        "Two that start at once are measured more often, since what may go wrong then is rare.",
        "**Departure** and **death** begin with the signal, the pulled cable (the milliseconds the "
        "command takes count, too) or the loop's last word, after the link has lasted for 0.5 to "
        "1.5 s, and end with the other host's `PeerLost`. Before its goodbye, a whole daemon "
        "also halts what it does for peers and at peers; that is not in here.",
        "After `kill -9` the connection breaks at once; the other host waits for half a second "
        "whether it comes back, since not every link that breaks is a host that died.",
    )
    if AT_ONCE.late(found[AT_ONCE]):
        yield _text(
            "Of hosts that start at the same moment, few miss each other's first words. They meet "
            "by the next announcement, up to a second later."
        )
    if DEPARTURE.late(found[DEPARTURE]):
        yield _text(
            "Departures are late since `Mesh.close` lets discovery go first, which says goodbye by "
            "multicast three times in a quarter of a second; the links' own goodbyes come after it."
        )
    if left_out := [kind.name for kind in KINDS if kind not in found]:
        yield _text(f"Not measured, since network namespaces need root: {', '.join(left_out)}.")


def _calls(found: calls.Found, calls_each: int) -> Iterator[str]:
    yield "## Calls"
    yield _text(
        "A 200-byte request and a 100-byte reply between two processes over TCP on loopback, "
        f"msgpack at both ends: {calls_each:,} calls one by one, then {4 * calls_each:,} with "
        f"{measuring.IN_FLIGHT} in flight. CPU counts both processes with all their threads."
    )
    rivals = [way for way in found if way not in calls.OURS]
    first = calls.OURS[0]
    ratios = {f"nondum ÷ {way.partition(',')[0]}": (first, way) for way in rivals}
    yield measuring.call_table(found, ratios)
    medians = Spread(tuple(one.median_us for one in found[first]))
    held = sum(one <= CALL_AIM_US for one in medians.repeats)
    verdict = "met" if medians.median <= CALL_AIM_US else "MISSED"
    yield _text(
        f"Aim: at most {CALL_AIM_US:.0f} µs in median with CURVE: **{verdict}** with "
        f"{medians:.0f}, within it in {held} of {len(medians.repeats)}."
    )
    yield _list(
        "The peer link also checks every message against its limits and its key, carries "
        "deadlines, and remembers answers so that no call runs twice; the others here do none of "
        "this.",
        "Peers that are not encrypted (development mode) tell what CURVE costs; gRPC and Zenoh are "
        "not encrypted either. Zenoh: two peers, a querier and a queryable, "
        "shared memory off, set as it was quickest. From asyncio, replies hop from Zenoh's thread "
        "to the loop, as in any program with a loop; from threads, the caller waits for its reply, "
        "and no program with a loop may. Zenoh answers on a separate thread, all others on a "
        "loop.",
        "p99 mostly shows what else the machine was doing; compare medians and ratios.",
    )
    if lacking := calls.missing():
        yield _text(f"Not installed, and so not measured: {', '.join(lacking)}.")


def _text(words: str) -> str:
    return fill(words, WIDTH, break_on_hyphens=False)


def _list(*points: str) -> str:
    told = (
        fill(f"- {one}", WIDTH, subsequent_indent="  ", break_on_hyphens=False) for one in points
    )
    return "\n".join(told)


def _finite(seconds: float) -> float | None:
    return seconds if math.isfinite(seconds) else None


def _libraries() -> str:
    used = {"zeroconf": "zeroconf", "grpc": "grpcio", "zenoh": "eclipse-zenoh"}
    told = [f"{name} {version(name)}" for module, name in used.items() if find_spec(module)]
    return ", ".join([f"pyzmq {zmq.__version__}, libzmq {zmq.zmq_version()}", *told])
