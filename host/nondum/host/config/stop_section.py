"""The table `[stop]` of the configuration."""

from __future__ import annotations

import re
from collections.abc import Iterator

from nondum.host.config.places import Places
from nondum.host.config.stop_keys import code_of
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

DEVICE = re.compile(r"/dev/input/((by-id|by-path)/[A-Za-z0-9_.:+@-]{1,200}|event[0-9]{1,4})")


@frozen
class StopSection:
    """What stops the robot beside the word, and what is told of it; see docs/stopping.md."""

    device: str = ""
    """The input device with the key, by its path below /dev/input, best below by-id or by-path."""
    key: str = ""
    """Its name (`KEY_ENTER`, `BTN_0`) or number in Linux' input-event-codes.h."""
    hook: tuple[str, ...] = ()
    """A program, and its arguments, that is run each time that the robot is stopped."""
    hook_deadline_s: float = 10.0
    """What it has for that; then it is killed, with all that it started."""


def problems(section: StopSection, places: Places) -> Iterator[Problem]:
    """What is wrong with its values."""
    if section.device and not DEVICE.fullmatch(section.device):
        expected = "a path such as /dev/input/by-id/usb-…-event-kbd"
        yield _wrong("device", section.device, expected, places)
    if section.key and code_of(section.key) is None:
        yield _wrong(
            "key", section.key, "the name of a key such as KEY_ENTER, or its number", places
        )
    if bool(section.device) != bool(section.key):
        key = "key" if section.device else "device"
        yield _wrong(key, "", "both a device and a key", places)
    if section.hook and not section.hook[0].startswith("/"):
        yield _wrong("hook", section.hook[0], "a program by its full path", places)
    if any("\0" in word for word in section.hook):
        yield _wrong("hook", list(section.hook), "words without NUL", places)


def _wrong(key: str, value: object, expected: str, places: Places) -> Problem:
    text = f"[stop] {key} = {value!r}: expected {expected}"
    return Problem("CONFIG_VALUE", text, where=places.of("stop", key))
