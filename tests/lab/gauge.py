"""An emulated instrument on a serial line, and the plugin that reads it: a gauge that counts.

The instrument sends a line whenever it has counted on; its readers know that number only
from the bytes.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from demo.emulators.socket_port import SocketPort
from tests.kit.payloads import Part

EVERY_S = 0.2

PLUGIN = '''"""Reads a gauge on a serial line for as long as it is there."""
import os, select, tty

from nondum.sdk import (
    BehaviourFailed, DeviceNeed, Fragment, Header, Output, Scalar, Unit, behaviour, hookimpl,
)

DOMAIN = """
(define (domain gauge)
  (:action read
    :parameters (?u - sensor ?o - scalar ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h))))
"""

@hookimpl
def units():
    return [Unit("gauge", "sensor", outputs=(Output("level", "scalar"),))]

@hookimpl
def devices():
    return [DeviceNeed("line", MATCH)]

@hookimpl
def fragments():
    return [Fragment("gauge.pddl", DOMAIN)]

@behaviour("read", action="(read ?u - sensor ?o - scalar ?h - host)", lasting=True)
async def read(ctx, u, o, h):
    output, heard, begun = ctx.output(o), b"", False
    line, flags = select.poll(), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK
    port = os.open(ctx.device("line").node, flags)
    line.register(port, select.POLLIN)
    try:
        tty.setraw(port)
        while True:
            for _, events in line.poll(0):
                if events & (select.POLLHUP | select.POLLERR):
                    raise OSError("hung up")
                heard += os.read(port, 4096)
            *whole, heard = heard.split(b"\\n")
            for number in whole:
                if begun:  # the first may have been cut
                    output.send(Scalar(Header(frame_id=u), float(number), "1"))
                    await ctx.established()
                begun = True
            await ctx.sleep(0.05)
    except (OSError, tty.error) as error:
        raise BehaviourFailed(f"nothing is heard any more: {error}", code="GAUGE_GONE")
    finally:
        os.close(port)
'''


def reader(match: Mapping[str, str]) -> Part:
    """Makes the stream `spot__gauge__level` flow while it reads a gauge that matches."""
    properties = ", ".join(f'{name} = "{value}"' for name, value in match.items())
    need = f'[[component.device]]\nname = "line"\nmatch = {{ {properties} }}\n'
    return Part("gauge", PLUGIN.replace("MATCH", repr(dict(match))), manifest=need)


class Gauge:
    """The instrument, switched on."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.count = 0
        """What it has counted to."""
        self._port = SocketPort(path)
        self._is_on = threading.Event()
        self._thread = threading.Thread(target=self._work)
        self._is_on.set()
        self._thread.start()

    def close(self) -> None:
        """Switch it off."""
        self._is_on.clear()
        self._thread.join()
        self._port.close()

    def _work(self) -> None:
        while self._is_on.is_set():
            self._port.read(EVERY_S)
            self.count += 1
            self._port.write(b"%d\n" % self.count)


@contextmanager
def switched_on(path: Path) -> Iterator[Gauge]:
    """A gauge at a socket."""
    gauge = Gauge(path)
    try:
        yield gauge
    finally:
        gauge.close()
