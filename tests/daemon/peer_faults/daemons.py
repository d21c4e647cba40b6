"""Whole hosts, one on each machine, all on one switch, that are paired with each other."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from demo.namespaces import Cable, Network
from tests.daemon.neighbours import until_peer
from tests.kit.on_machine import on
from tests.kit.payloads import Part
from tests.kit.running_host import DAEMON, READY_S, RunningHost
from tests.kit.until import until

from nondum.host.peers.trust_store import KEY_NAME, TRUST_NAME
from nondum.transport.peers import Trust, trust_file
from nondum.transport.peers.keys import load_or_create

OVER = {"reached", "failed", "halted"}
"""States of goals that are pursued no more."""
SECTION = '[workers]\nconfinement = "none"\n[peers]\nenabled = true\n'


class WiredHost(RunningHost):
    """A daemon on a machine of a network."""

    def __init__(self, work: Path, cable: Cable) -> None:
        machine = cable.machine
        work.mkdir()
        _, _, module, *arguments = DAEMON
        program = on(machine, module, *arguments)
        super().__init__(work, name=machine.name, more=SECTION, program=program)
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


def clear(hosts: Sequence[WiredHost]) -> None:
    """Bring hosts that run back to where they began: all cables in, no goals, no payloads."""
    for host in hosts:
        host.cable.put_back()
        for row in host.view["goals"]:
            if row["state"] not in OVER:
                host.ask("halt", id=row["id"])
        for drive in host.plugged:
            host.pull(drive)
    for host in hosts:
        host.until(
            "nothing is left",
            lambda view: not view["payloads"] and not view["components"],
            timeout_s=READY_S,
        )


LAMP = '''"""Shines until stopped, or signals until told to end, and writes down which."""
import asyncio
import os
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
        await told_to_end()
        word = "done"
    finally:
        note(word)

async def told_to_end():
    fifo = os.open("LOG.end", os.O_RDWR | os.O_NONBLOCK)
    is_told = asyncio.Event()
    asyncio.get_running_loop().add_reader(fifo, is_told.set)
    try:
        await is_told.wait()
        os.read(fifo, 1)
    finally:
        asyncio.get_running_loop().remove_reader(fifo)
        os.close(fifo)

def note(word):
    with open("LOG", "a") as log:
        log.write(word + "\\n")
'''


class Log:
    """What a lamp has written down; by this it is also told when to end a signal."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._fifo = file.with_name(f"{file.name}.end")
        os.mkfifo(self._fifo)

    def lamp(self, *, when_lost: str) -> Part:
        """The lamp that writes here."""
        code = LAMP.replace("LOST", when_lost)
        return Part("lamp", code.replace("LOG", str(self._file)))

    def end_signal(self) -> None:
        """Tell the signal that has begun to end."""
        with self._fifo.open("wb", buffering=0) as fifo:
            fifo.write(b".")

    @property
    def words(self) -> list[str]:
        """All that was written, oldest first."""
        return self._file.read_text(encoding="utf-8").split() if self._file.exists() else []

    def until(self, *words: str) -> None:
        """Wait until exactly that is written. Fails at once when more is written."""

        def look() -> bool:
            written = self.words
            assert written == list(words)[: len(written)], written
            return len(written) == len(words)

        until(f"written: {words}", look, evidence=lambda: self.words)
