"""A serial line is read and written without blocking; whatever goes wrong is one failure."""

from __future__ import annotations

import asyncio
import fcntl
import os
import pty
import termios
import tty
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest
from tests.kit.until import PATIENCE_S

from nondum.sdk.errors import BehaviourFailed
from nondum.sdk.serial_line import FAILED, SerialLine

BAUD = 9600


class Device:
    """What is at the other end of a line."""

    def __init__(self) -> None:
        self.far, self._near = pty.openpty()
        tty.setraw(self._near)
        self.node = os.ttyname(self._near)
        self._is_plugged = True

    def unplug(self) -> None:
        if self._is_plugged:
            for end in (self.far, self._near):
                os.close(end)
        self._is_plugged = False


@pytest.fixture
def device() -> Iterator[Device]:
    device = Device()
    yield device
    device.unplug()


@pytest.mark.anyio
async def test_what_comes_is_received_and_what_is_sent_arrives(device: Device) -> None:
    with SerialLine(device.node, BAUD) as line:
        os.write(device.far, b"hello")
        assert await line.receive() == b"hello"
        line.send(b"you")
        assert os.read(device.far, 10) == b"you"


def test_line_is_opened_by_one_alone(device: Device) -> None:
    with SerialLine(device.node, BAUD):
        with pytest.raises(BehaviourFailed) as failed:
            SerialLine(device.node, BAUD)
        assert (failed.value.code, failed.value.problems[0].where) == (FAILED, device.node)
    SerialLine(device.node, BAUD).__exit__(None, None, None)


@pytest.mark.parametrize(
    ("module", "call"),
    [(fcntl, "flock"), (termios, "tcgetattr"), (termios, "tcsetattr"), (termios, "tcflush")],
    ids=["locked", "asked", "set", "flushed"],
)
def test_a_device_pulled_before_its_port_is(
    device: Device, monkeypatch: pytest.MonkeyPatch, module: ModuleType, call: str
) -> None:
    untouched = getattr(module, call)

    def pulled(*arguments: Any) -> Any:
        monkeypatch.undo()
        device.unplug()
        return untouched(*arguments)

    monkeypatch.setattr(module, call, pulled)
    with pytest.raises(BehaviourFailed) as failed:
        SerialLine(device.node, BAUD)
    assert failed.value.code == FAILED


@pytest.mark.anyio
async def test_a_device_pulled_while_it_is_waited_for(device: Device) -> None:
    with SerialLine(device.node, BAUD) as line:
        device.unplug()
        with pytest.raises(BehaviourFailed) as failed:
            await line.receive()
        assert failed.value.code == FAILED


@pytest.mark.anyio
async def test_closed_while_it_is_waited_for_it_leaves_its_descriptor_to_the_next(
    device: Device,
) -> None:
    loop, ready = asyncio.get_running_loop(), asyncio.Event()
    reading, writing = os.pipe()
    with SerialLine(device.node, BAUD) as line:
        number = line._port.fileno()
        waiting = asyncio.create_task(line.receive())
        await asyncio.sleep(0)
    os.dup2(reading, number)
    waiting.cancel()
    await asyncio.wait({waiting})
    loop.add_reader(number, ready.set)
    os.write(writing, b"x")
    await asyncio.wait_for(ready.wait(), PATIENCE_S)
    loop.remove_reader(number)
    for one in (reading, writing, number):
        os.close(one)
