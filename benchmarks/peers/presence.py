"""How long hosts take to find and to lose each other."""

from __future__ import annotations

import math
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass

from benchmarks.peers.crew import Host, NotSeen, crew
from benchmarks.peers.ground import Ground

AGES_S = (0.5, 1.5)
"""How long links have lasted when something happens to them: at any moment between two pings."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One repeat."""

    took_s: float
    """Infinite for what did not come about."""
    told: str = ""
    """Why a peer is lost, as it was told."""
    starting_s: float = 0.0
    """How long discovery took to start, before it was up."""


@dataclass(frozen=True, slots=True)
class Kind:
    """Something that is timed."""

    name: str
    aim_s: float
    take: Callable[[Ground], Sample]
    needs_cables: bool = False
    times: int = 1
    """How often in one repeat: more where what is rare matters."""

    def late(self, samples: Sequence[Sample]) -> int:
        """How many took longer than they should."""
        return sum(one.took_s > self.aim_s for one in samples)


def at_once(ground: Ground) -> Sample:
    """Two hosts that start at one moment."""
    with crew(ground, 2) as hosts:
        for one in hosts:
            one.order("start")
        return found(hosts[1], hosts[:1])


def third(ground: Ground) -> Sample:
    """A third host that starts beside two that are linked."""
    with crew(ground, 3) as (*linked, new):
        link(*linked)
        new.order("start")
        return found(new, linked)


def found(new: Host, others: Sequence[Host]) -> Sample:
    """From the moment that all are up to the last event by which one has another as a peer."""
    started = [one.find("started") for one in (new, *others)]
    pairs = [pair for other in others for pair in ((new, other), (other, new))]
    met_s = max(one.find("up", other)["at_s"] for one, other in pairs)
    last = max(started, key=lambda told: float(told["at_s"]))
    return Sample(met_s - last["at_s"], starting_s=last["took_s"])


def link(*hosts: Host) -> None:
    """Start hosts, and let their links last for a while."""
    for one in hosts:
        one.order("start")
    for one in hosts:
        for other in hosts:
            if one is not other:
                one.find("up", other)
    time.sleep(random.uniform(*AGES_S))


Fault = Callable[[Ground, Host], AbstractContextManager[float]]
"""Strikes the second host; when it did."""


def lost_by(fault: Fault) -> Callable[[Ground], Sample]:
    """From a fault at one of two hosts to the event by which the other one has lost it."""

    def take(ground: Ground) -> Sample:
        with crew(ground, 2) as (witness, struck):
            link(witness, struck)
            with fault(ground, struck) as at_s:
                lost = witness.find("lost", struck, after_s=at_s)
                return Sample(lost["at_s"] - at_s, lost["reason"])

    return take


def signalled(number: signal.Signals) -> Fault:
    """A signal to its process."""

    def strike(_ground: Ground, struck: Host) -> AbstractContextManager[float]:
        at_s = time.monotonic()
        os.kill(struck.pid, number)
        return nullcontext(at_s)

    return strike


def hung(_ground: Ground, struck: Host) -> AbstractContextManager[float]:
    """A loop that does not go on; the host itself tells when it begins."""
    struck.order("hang")
    return nullcontext(struck.find("hung")["at_s"])


@contextmanager
def unplugged(ground: Ground, _struck: Host) -> Iterator[float]:
    """Its cable is pulled; how long that takes (some milliseconds) counts, too."""
    at_s = time.monotonic()
    with ground.unplugged(1):
        yield at_s


AT_ONCE = Kind("found: two that start at once", 0.1, at_once, times=10)
DEPARTURE = Kind("departure: SIGTERM", 0.05, lost_by(signalled(signal.SIGTERM)))
KINDS = (
    AT_ONCE,
    Kind("found: a third that starts beside two", 0.1, third),
    DEPARTURE,
    Kind("death: kill -9", 1.5, lost_by(signalled(signal.SIGKILL))),
    Kind("death: SIGSTOP", 1.5, lost_by(signalled(signal.SIGSTOP))),
    Kind("death: the loop hangs", 1.5, lost_by(hung)),
    Kind("death: the cable is pulled", 1.5, lost_by(unplugged), needs_cables=True),
)

Found = dict[Kind, list[Sample]]


def measure(ground: Ground, repeats: int) -> Found:
    """All kinds, repeat by repeat in turn; those that the ground has not are left out."""
    found: Found = {one: [] for one in KINDS if ground.machines or not one.needs_cables}
    for _ in range(repeats):
        for kind, samples in found.items():
            for _ in range(kind.times):
                samples.append(sample(kind, ground))
                print(f"peers: {kind.name}: {samples[-1]}", file=sys.stderr)
    return found


def sample(kind: Kind, ground: Ground) -> Sample:
    """One repeat, whatever comes of it."""
    try:
        return kind.take(ground)
    except NotSeen as missed:
        return Sample(math.inf, f"not seen ({missed})")
