"""Whole hosts on machines of their own, all on one switch, that are paired with each other."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from demo.namespaces import Cable, Network
from tests.daemon.neighbours import until_peer
from tests.daemon.peer_faults.remote import PATIENCE_S
from tests.kit.payloads import Part
from tests.kit.running_host import DAEMON, RunningHost

from nondum.host.peers.trust_keeper import KEY_NAME, TRUST_NAME
from nondum.transport.peers import Trust, trust_file
from nondum.transport.peers.keys import load_or_create

SECTION = '[workers]\nconfinement = "0"\nminimum_confinement = 0\n[peers]\nenabled = true\n'


class WiredHost(RunningHost):
    """A daemon on a machine of a network."""

    def __init__(self, work: Path, cable: Cable) -> None:
        machine = cable.machine
        work.mkdir()
        super().__init__(work, name=machine.name, more=SECTION, program=machine.command(*DAEMON))
        self.cable = cable
        (self.state / "peers").mkdir(parents=True, mode=0o700)
        self.keys = load_or_create(self.state / "peers" / KEY_NAME)

    def trust(self, others: list[WiredHost]) -> None:
        """Have it paired with others, before it is started."""
        paired = {other.keys.public: other.name for other in others if other is not self}
        trust_file.save(self.state / "peers" / TRUST_NAME, Trust(paired=paired))


@contextmanager
def wired(work: Path, *names: str) -> Iterator[list[WiredHost]]:
    """Hosts that run, and have found each other."""
    with Network() as network, ExitStack() as stack:
        switch = network.switch()
        cables = [network.plug(network.machine(name), switch) for name in names]
        hosts = [WiredHost(work / cable.machine.name, cable) for cable in cables]
        for host in hosts:
            host.trust(hosts)
            stack.callback(host.stop)
            host.start()
        for host in hosts:
            for other in names:
                if other != host.name:
                    until_peer(host, other)
        yield hosts


LAMP = '''"""Shines until it is stopped, or signals for a while, and writes down which."""
import asyncio
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain lamp)
  (:predicates (lit ?h - host) (warned ?h - host))
  (:action shine
    :parameters (?u - light ?h - host)
    :precondition (and (ready ?u) (idle ?u))
    :effect (and (not (idle ?u)) (lit ?h)))
  (:action signal
    :parameters (?u - light ?h - host)
    :precondition (and (ready ?u) (idle ?u))
    :effect (warned ?h)))
"""

@hookimpl
def units():
    return [Unit("lamp", "light", users=1)]

@hookimpl
def fragments():
    return [Fragment("lamp.pddl", DOMAIN)]

@behaviour("shine", action="(shine ?u - light ?h - host)", lasting=True, when_lost="LOST")
async def shine(ctx, u, h):
    note("on")
    try:
        await ctx.established()
        while True:
            await ctx.sleep(60)
    finally:
        note("off")

@behaviour("signal", action="(signal ?u - light ?h - host)", when_lost="LOST")
async def signal(ctx, u, h):
    note("begun")
    word = "halted"
    try:
        await ctx.sleep(SIGNAL_S)
        word = "done"
    finally:
        note(word)

def note(word):
    with open("LOG", "a") as log:
        log.write(word + "\\n")
'''


def lamp(log: Path, *, when_lost: str, signal_s: float = 6.0) -> Part:
    """A lamp that writes down when it shines, and when it signals, which takes a while."""
    code = LAMP.replace("LOST", when_lost).replace("SIGNAL_S", str(signal_s))
    return Part("lamp", code.replace("LOG", str(log)))


def until_written(log: Path, *words: str) -> None:
    """Wait for a lamp to have written exactly that. Fails at once when it has written more."""
    pause, found = threading.Event(), []
    for _ in range(int(PATIENCE_S / 0.05)):
        found = log.read_text(encoding="utf-8").split() if log.exists() else []
        if found == list(words):
            return
        assert found == list(words)[: len(found)], found
        pause.wait(0.05)
    raise AssertionError(found)
