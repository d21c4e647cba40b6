"""The one key that stops the robot is heard, and no other."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.until import arrived

from nondum.host.config.stop_section import StopSection
from nondum.host.people.stop_button.button import AGAIN_S, StopButton
from nondum.host.sandbox.helper.stop_key import EV_KEY, EVENT, PressesOfDevice, opened
from nondum.sdk.errors import InstallFailed

pytestmark = pytest.mark.anyio

PAUSE, ENTER = 119, 28
SECTION = StopSection(device="/dev/input/event0", key="KEY_PAUSE")
DOWN, UP, HELD = 1, 0, 2


class Keyboard:
    """The bytes that a device gives."""

    def __init__(self) -> None:
        self.reading, self._writing = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)

    def type(self, code: int, *values: int) -> None:
        """A key goes down, up, or is held."""
        for value in values:
            os.write(self._writing, EVENT.pack(0, 0, EV_KEY, code, value))
            os.write(self._writing, EVENT.pack(0, 0, 0, 0, 0))  # EV_SYN

    def unplug(self) -> None:
        """It gives nothing any more."""
        if self._writing >= 0:
            os.close(self._writing)
            self._writing = -1


@pytest.fixture
def keyboard() -> Iterator[Keyboard]:
    made = Keyboard()
    yield made
    made.unplug()


def test_presses_of_one_key_are_counted(keyboard: Keyboard) -> None:
    presses = PressesOfDevice(keyboard.reading, PAUSE)
    keyboard.type(ENTER, DOWN, UP)
    keyboard.type(PAUSE, DOWN, HELD, HELD, UP)
    assert presses.read() == 1
    assert presses.read() == 0
    keyboard.type(PAUSE, UP)
    assert presses.read() == 0
    keyboard.unplug()
    with pytest.raises(OSError, match="device"):
        presses.read()
    presses.close()


def test_what_is_no_input_device_is_refused(tmp_path: Path) -> None:
    (file := tmp_path / "file").touch()
    for path in (file, tmp_path / "none", Path("/dev/null")):
        with pytest.raises(InstallFailed) as refused:
            opened(path, PAUSE)
        assert refused.value.code == "STOP_KEY"
        assert refused.value.problems[0].where == str(path)


async def test_robot_is_stopped_by_each_press(keyboard: Keyboard) -> None:
    stopped = asyncio.Queue[None]()
    button = listening(stopped, PressesOfDevice(keyboard.reading, PAUSE))
    running = asyncio.create_task(button.run())
    keyboard.type(PAUSE, DOWN)
    await arrived("the stop", stopped.get())
    keyboard.type(ENTER, DOWN, UP)
    keyboard.type(PAUSE, UP, DOWN)
    await arrived("the stop", stopped.get())
    assert stopped.empty()
    await end(running)


async def test_key_that_is_held_when_listening_begins_stops(keyboard: Keyboard) -> None:
    stopped = asyncio.Queue[None]()
    button = listening(stopped, PressesOfDevice(keyboard.reading, PAUSE, is_down=True))
    running = asyncio.create_task(button.run())
    await arrived("the stop", stopped.get())
    await end(running)


async def test_device_is_looked_for_again(clock: VirtualClock) -> None:
    first, second = Keyboard(), Keyboard()
    with pytest.raises(InstallFailed) as refused:
        opened(Path("/dev/null"), PAUSE)
    stopped, gone = asyncio.Queue[None](), refused.value
    found = [PressesOfDevice(one.reading, PAUSE) for one in (first, second)]
    button = listening(stopped, gone, found[0], gone, gone, found[1])
    running = asyncio.create_task(button.run())
    first.type(PAUSE, DOWN)
    await clock.advance_until(stopped.get(), AGAIN_S / 4)
    assert not button.warnings
    first.unplug()
    second.type(PAUSE, DOWN)
    await clock.advance_until(stopped.get(), AGAIN_S / 4)
    await end(running)
    second.unplug()


async def test_missing_device_is_a_warning(clock: VirtualClock) -> None:
    with pytest.raises(InstallFailed) as refused:
        opened(Path("/dev/null"), PAUSE)
    asked = asyncio.Queue[None]()
    button = listening(asyncio.Queue(), *[refused.value] * 100, asked=asked)
    running = asyncio.create_task(button.run())
    for _ in range(2):  # the second time, the first result was told
        await clock.advance_until(asked.get(), AGAIN_S / 4)
    assert button.warnings == (str(refused.value),)
    await end(running)


async def test_without_a_device_nothing_is_opened() -> None:
    await arrived("the end", listening(asyncio.Queue()).run())


def listening(
    stopped: asyncio.Queue[None],
    *openings: PressesOfDevice | InstallFailed,
    asked: asyncio.Queue[None] | None = None,
) -> StopButton:
    """A button whose device is opened with these results, one after the other."""
    left, loop = list(openings), asyncio.get_running_loop()

    def open_key(path: Path, code: int) -> PressesOfDevice:
        assert (path, code) == (Path(SECTION.device), PAUSE)
        if asked is not None:
            loop.call_soon_threadsafe(asked.put_nowait, None)
        opening = left.pop(0)
        if isinstance(opening, InstallFailed):
            raise opening
        return opening

    async def on_press() -> None:
        stopped.put_nowait(None)

    return StopButton(SECTION if openings else StopSection(), on_press, open_key)


async def end(running: asyncio.Task[None]) -> None:
    running.cancel()
    with suppress(asyncio.CancelledError):
        await running
