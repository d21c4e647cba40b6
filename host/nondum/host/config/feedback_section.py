"""The table `[feedback]` of the configuration."""

from __future__ import annotations

import re
from collections.abc import Iterator

from nondum.host.config.places import Places
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen

LAMP = re.compile(r"[A-Za-z0-9_:.*?+@-]{1,64}")


@frozen
class FeedbackSection:
    """How people are shown the host's state who have no screen."""

    lamps: tuple[str, ...] = ()
    """Lamps of the kernel's LED class, by name; `*` and `?` may stand in it: `*::capslock`."""
    hook: tuple[str, ...] = ()
    """A program, and its first arguments, that is run for every state; see docs/feedback.md."""
    hook_deadline_s: float = 10.0
    """What it has for that; then it is killed, with all that it started."""
    player: tuple[str, ...] = ()
    """A program that plays the WAV file at its standard input: `["/usr/bin/aplay", "-q"]`."""
    speak: bool = True
    """Whether components that speak say refusals that are too long otherwise, and that a drive may
    be pulled."""
    refused_s: float = 60.0
    """How long a refusal is shown, unless its drive is pulled before."""
    safe_s: float = 15.0
    """How long it is shown that a drive may be pulled."""


def problems(section: FeedbackSection, places: Places) -> Iterator[Problem]:
    """What is wrong with its values."""
    for name in section.lamps:
        if not LAMP.fullmatch(name):
            yield _wrong("lamps", name, "a name in /sys/class/leds", places)
    for key, command in (("hook", section.hook), ("player", section.player)):
        if command and not command[0].startswith("/"):
            yield _wrong(
                key, command[0], "a program by its full path, such as /usr/bin/env", places
            )
        if any("\0" in word for word in command):
            yield _wrong(key, list(command), "words without NUL", places)


def _wrong(key: str, value: object, expected: str, places: Places) -> Problem:
    text = f"[feedback] {key} = {value!r}: expected {expected}"
    return Problem("CONFIG_VALUE", text, where=places.of("feedback", key))
