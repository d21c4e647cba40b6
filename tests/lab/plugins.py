"""Small plugins for scenarios: each has one behaviour, and its author writes what that does."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tests.kit.payloads import Part, installed_wheel
from tests.lab.installed import Installed

SOURCE = '''"""Does one thing when it is asked to."""
import asyncio, os, subprocess, sys, time
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain {id})
  (:predicates ({id}-done ?h - host))
  (:action do-{id}
    :parameters (?u - sensor ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect ({id}-done ?h)))
"""

@hookimpl
def units():
    return [Unit("it", "sensor")]

@hookimpl
def fragments():
    return [Fragment("{id}.pddl", DOMAIN)]

@behaviour("do-{id}", action="(do-{id} ?u - sensor ?h - host)")
async def do(ctx, u, h):
    {body}
'''

FAMILY_OF_HOGS = (
    "eat = 'b = []\\nwhile True: b.append(bytearray(1 << 20))'\n"
    "hogs = [subprocess.Popen([sys.executable, '-I', '-S', '-c', eat]) for _ in range(3)]\n"
    "while all(hog.poll() is None for hog in hogs):\n"
    "    await asyncio.sleep(0.05)\n"
    "await asyncio.sleep(60)"
)


def doer(id: str, body: str) -> Part:
    """Its goal is `(<id>-done self)`; `body` is of a coroutine with `ctx`, `u` and `h`."""
    source = SOURCE.replace("{body}", body.replace("\n", "\n    ")).replace("{id}", id)
    return Part(id, source)


def hogs(id: str = "hogs") -> Part:
    """Three processes that take memory for ever: each alone, and all together."""
    return doer(id, FAMILY_OF_HOGS)


OPENER = '''"""Opens all nodes of a device that it is given, and says so."""
import asyncio, os
from nondum.sdk import DeviceNeed, Unit, hookimpl

@hookimpl
def units():
    return [Unit("it", "sensor")]

@hookimpl
def devices():
    return [DeviceNeed("it", {match})]

async def look(ctx):
    had = None
    while True:
        device = ctx.device("it")
        if device != had:
            had = device
            ctx.log.info("has: %s", ", ".join(map(opened, device.nodes)) if device else "nothing")
        await asyncio.sleep(0.2)

def opened(node):
    name = os.path.basename(node.properties["DEVNAME"])
    try:
        os.close(os.open(node.node, os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY))
    except OSError as error:
        return f"{name} ({error.strerror})"
    return f"{name} (opened)"

@hookimpl
async def start(ctx):
    ctx.spawn(look(ctx))
'''


READER = '''"""Asks a smart card reader, which has no driver in the kernel, for its state."""
import asyncio
from nondum.sdk import DeviceNeed, Unit, hookimpl
from nondum.sdk.usb import open_usb

GET_SLOT_STATUS, SLOT_STATUS = 0x65, 0x81

@hookimpl
def units():
    return [Unit("slot", "sensor")]

@hookimpl
def devices():
    return [DeviceNeed("it", {match})]

async def look(ctx):
    had = None
    while True:
        device = ctx.device("it")
        if device != had:
            had = device
            try:
                said = await asyncio.to_thread(asked, device) if device else "nothing"
            except Exception as error:  # it may be pulled at any moment
                said = f"nothing, for {error}"
            ctx.log.info("has: %s", said)
        await asyncio.sleep(0.2)

def asked(device):
    import usb.util
    with open_usb(device) as reader:
        interface = reader.get_active_configuration()[0, 0]
        ends = {usb.util.endpoint_direction(e.bEndpointAddress): e for e in interface
                if usb.util.endpoint_type(e.bmAttributes) == usb.util.ENDPOINT_TYPE_BULK}
        ends[usb.util.ENDPOINT_OUT].write(bytes([GET_SLOT_STATUS, 0, 0, 0, 0, 0, 7, 0, 0, 0]))
        answer = ends[usb.util.ENDPOINT_IN].read(64)
        assert answer[0] == SLOT_STATUS and answer[6] == 7, list(answer)
        return f"{reader.idVendor:04x}:{reader.idProduct:04x} (answers {answer.tobytes().hex()})"

@hookimpl
async def start(ctx):
    ctx.spawn(look(ctx))
'''


def opener(id: str, **match: str) -> Part:
    """Opens every node of its device, once each time that it is given other ones, and logs that."""
    return _with_device(id, OPENER, match)


def card_reader(id: str = "reader") -> Part:
    """Asks its device something through pyusb, which it brings, each time that it is given another
    one, and logs the answer; the library is the machine's."""
    match = {"usb": "08e6:4433", "subsystem": "usb"}
    return _with_device(id, READER, match, installed_wheel("pyusb"))


def _with_device(id: str, source: str, match: Mapping[str, str], *wheels: Path) -> Part:
    rules = ", ".join(f'{key} = "{pattern}"' for key, pattern in match.items())
    need = f'[[component.device]]\nname = "it"\nmatch = {{ {rules} }}\n'
    return Part(id, source.replace("{match}", repr(match)), manifest=need, wheels=wheels)


def until_said(host: Installed, id: str, word: str, least: int = 1) -> str:
    """What an `opener` or `card_reader` said last of its nodes, once all that it says of them has a
    word, at least so often."""

    def found() -> str | None:
        said = host.machine.attempt(f"nondum logs {id}").out
        lines = [line for line in said.splitlines() if "has: " in line]
        last = lines[-1].rpartition("has: ")[2] if lines else ""
        return last if last.count(word) >= least and last.count("(") <= last.count(word) else None

    return host.machine.until(f"{id} says {word}", found, every_s=1.0)
