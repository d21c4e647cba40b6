"""Hosts that know each other, on this machine's loopback: whole daemons, one process each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from demo.ports import free_port
from tests.kit.payloads import Part
from tests.kit.running_host import READY_S, RunningHost
from tests.transport.fleet.fleets import router

UNCONFINED = '[workers]\nconfinement = "none"\n\n'
"""Plugins of these tests write a log file outside their sandboxes."""


@contextmanager
def neighbours(work: Path, *names: str, more: str = "") -> Iterator[list[RunningHost]]:
    """Hosts that need no keys and are each other's peers; `more` are further lines of [peers]."""
    with looking(work, *names, more=f"development = true\n{more}") as hosts:
        for host in hosts:
            for other in names:
                if other != host.name:
                    until_peer(host, other)
        yield hosts


class OpenHost(NamedTuple):
    """A host that needs no keys, and where it listens."""

    host: RunningHost
    address: str


@contextmanager
def open_host(work: Path, name: str, port: int = 0) -> Iterator[OpenHost]:
    """One host that needs no keys, and where it listens, unless that port is taken."""
    port = port or free_port()
    host = RunningHost(
        work, name=name, more=UNCONFINED + _section(port, []) + "development = true\n"
    )
    try:
        host.start()
        yield OpenHost(host, f"tcp://127.0.0.1:{port}")
    finally:
        host.stop()


@contextmanager
def routed(work: Path, *names: str) -> Iterator[list[RunningHost]]:
    """Hosts that need no keys and are each other's peers by way of a router."""
    port = free_port()
    own = router(port)
    with ExitStack() as stack:
        stack.callback(own.close)
        hosts: list[RunningHost] = []
        for name in names:
            (work / name).mkdir(parents=True)
            more = _section(free_port(), []) + "development = true\n"
            more += f'[router]\nendpoints = ["tcp/127.0.0.1:{port}"]\n'
            host = RunningHost(work / name, name=name, more=UNCONFINED + more)
            stack.callback(host.stop)
            host.start()
            hosts.append(host)
        for host in hosts:
            for other in names:
                if other != host.name:
                    until_peer(host, other)
        yield hosts


@contextmanager
def looking(work: Path, *names: str, more: str = "") -> Iterator[list[RunningHost]]:
    """Hosts that look for each other; `more` are further lines of [peers]."""
    ports = {name: free_port() for name in names}
    with ExitStack() as stack:
        hosts: list[RunningHost] = []
        for name in names:
            others = [f"127.0.0.1:{port}" for other, port in ports.items() if other != name]
            section = _section(ports[name], others)
            (work / name).mkdir(parents=True, exist_ok=True)
            host = RunningHost(work / name, name=name, more=UNCONFINED + section + more)
            stack.callback(host.stop)
            host.start()
            hosts.append(host)
        yield hosts


def until_peer(host: RunningHost, other: str) -> None:
    """Wait until a host has another one as its peer."""
    host.until_told(f"the host {other} is here")


def until_shared(host: RunningHost, component: str) -> None:
    """Wait until a component, `name@host`, is known."""
    host.until(
        f"{component} is shared",
        lambda view: any(row["component"] == component for row in view["components"]),
        timeout_s=READY_S,
    )


def _section(port: int, others: list[str]) -> str:
    return f"""
[peers]
enabled = true
discover = false
listen = ["tcp://127.0.0.1:{port}"]
static = {others}
"""


BEACON = '''"""Shines, and remembers how often."""
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain beacon)
  (:predicates (lit ?h - host) (seen ?h - host))
  (:action shine
    :parameters (?u - LAMP ?h - host)
    :precondition (and (ready ?u) (idle ?u))
    :effect (and (not (idle ?u)) (lit ?h)))
  (:action blink
    :parameters (?u - LAMP ?h - host)
    :precondition (and (ready ?u))
    :effect (seen ?h)))
"""

@hookimpl
def units():
    return [Unit("lamp", "LAMP", users=1)]

@hookimpl
def fragments():
    return [Fragment("beacon.pddl", DOMAIN)]

@behaviour("shine", action="(shine ?u - LAMP ?h - host)", lasting=True, when_lost="LOST")
async def shine(ctx, u, h):
    note(ctx, "on")
    try:
        await ctx.established()
        while True:
            await ctx.sleep(60)
    finally:
        note(ctx, "off")

@behaviour("blink", action="(blink ?u - LAMP ?h - host)", phrase="blink")
async def blink(ctx, u, h):
    note(ctx, "blink")

def note(ctx, word):
    with open("LOG", "a") as log:
        log.write(word + "\\n")
'''


LISTENER = '''"""Hears what somebody writes into a file."""
import asyncio
from pathlib import Path
from nondum.sdk import hookimpl

@hookimpl
async def listen(ctx):
    said = Path("FILE")
    while not said.exists():
        await asyncio.sleep(0.05)
    words = said.read_text()
    said.unlink()
    return {"words": words}
'''


def listener(said: Path) -> Part:
    """A payload with a `listen` hook; a person says something to it by `say`."""
    return Part("listener", LISTENER.replace("FILE", str(said)))


def say(said: Path, words: str) -> None:
    """Say something to a listener."""
    written = said.with_suffix(".part")
    written.write_text(words, encoding="utf-8")
    written.rename(said)


def beacon(log: Path, *, type: str = "light", when_lost: str = "stop") -> Part:
    """A lamp that writes down when it shines."""
    code = BEACON.replace("LAMP", type).replace("LOST", when_lost).replace("LOG", str(log))
    return Part("beacon", code)


def written(log: Path) -> list[str]:
    """What a beacon has written down."""
    return log.read_text(encoding="utf-8").split() if log.exists() else []
