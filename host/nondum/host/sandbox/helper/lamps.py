"""Lamps of the kernel's LED class: made to show a state, and at the end what they showed before.

What they showed is kept in a file from the first state on, so that the next daemon after one that
was killed still knows it.
"""

from __future__ import annotations

import fnmatch
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias

from nondum.host.core.feedback_state import State
from nondum.host.sandbox.helper.lamp_patterns import PATTERNS, Pattern
from nondum.sdk.errors import InstallFailed, NondumError, Problem
from nondum.sdk.frozen import frozen

LEDS = Path("/sys/class/leds")
MOST_LAMPS = 64
"""That a name may stand for."""
_CURRENT = re.compile(r"\[([^\]]*)\]")

Before: TypeAlias = dict[str, tuple[str, str]]
"""Lamp → its trigger and its brightness before the first state."""


@frozen
class Lamps:
    """The lamps that an integrator has chosen. All of it may block: not for the loop."""

    names: tuple[str, ...]
    """Names in the LED class; `*` and `?` stand for any letters, any letter."""
    kept: Path
    """The file in which is written what they showed before."""
    leds: Path = LEDS

    def show(self, state: State) -> None:
        """Have every lamp show a state. Raises `InstallFailed` (LAMP_MISSING, LAMP_UNREACHABLE,
        LAMP_TRIGGER) with what is wrong with any; the others show it."""
        found = list(self._found())
        self._keep(found)
        problems = [self._missing(name) for name in self.names if not self._called(name)]
        for lamp in found:
            try:
                _set(lamp, PATTERNS[state])
            except NondumError as error:
                problems.extend(error.problems)
        if problems:
            raise InstallFailed(*problems)

    def end(self) -> None:
        """Have every lamp show what it showed before; one that is gone is left."""
        for name, (trigger, brightness) in self._before().items():
            lamp = self.leds / name
            if not lamp.is_dir():
                continue
            try:
                (lamp / "trigger").write_text(trigger, encoding="ascii")
                if trigger == "none":
                    (lamp / "brightness").write_text(brightness, encoding="ascii")
            except OSError:  # it was pulled just now, or its trigger's module is gone
                continue
        self.kept.unlink(missing_ok=True)

    def _found(self) -> Iterator[Path]:
        names = dict.fromkeys(lamp for name in self.names for lamp in self._called(name))
        return (self.leds / name for name in tuple(names)[:MOST_LAMPS])

    def _called(self, name: str) -> list[str]:
        try:
            there = sorted(lamp.name for lamp in self.leds.iterdir())
        except OSError:
            return []
        return [lamp for lamp in there if fnmatch.fnmatchcase(lamp, name)]

    def _keep(self, lamps: list[Path]) -> None:
        """Write down what lamps show that were not made to show a state yet."""
        before = self._before()
        new = {
            lamp.name: shown for lamp in lamps if lamp.name not in before and (shown := _is(lamp))
        }
        if not new:
            return
        fresh = self.kept.with_name(f"{self.kept.name}.new")
        self.kept.parent.mkdir(parents=True, exist_ok=True)
        fresh.write_text(json.dumps({**before, **new}), encoding="utf-8")
        fresh.rename(self.kept)

    def _before(self) -> Before:
        try:
            said = json.loads(self.kept.read_text(encoding="utf-8"))
            return {name: (trigger, brightness) for name, (trigger, brightness) in said.items()}
        except FileNotFoundError:
            return {}
        except (ValueError, TypeError, AttributeError):  # cut short by a loss of power
            return {}

    def _missing(self, name: str) -> Problem:
        there = sorted(lamp.name for lamp in self.leds.glob("*"))
        have = ", ".join(there[:8]) or "none"
        fix = "choose one for `lamps` under [feedback], or plug it in"
        return Problem("LAMP_MISSING", "there is no such lamp", name, str(self.leds), have, fix)


def _is(lamp: Path) -> tuple[str, str] | None:
    """What a lamp shows; None: that cannot be read."""
    try:
        current = _CURRENT.search((lamp / "trigger").read_text(encoding="ascii"))
        brightness = (lamp / "brightness").read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return None
    return (current[1] if current else "none"), brightness


def _set(lamp: Path, pattern: Pattern) -> None:
    try:
        _have_trigger(lamp, pattern.trigger)
        if pattern.trigger == "timer":
            (lamp / "delay_on").write_text(str(pattern.on_ms), encoding="ascii")
            (lamp / "delay_off").write_text(str(pattern.off_ms), encoding="ascii")
        elif pattern.trigger == "none":
            brightest = (lamp / "max_brightness").read_text(encoding="ascii").strip()
            (lamp / "brightness").write_text(brightest, encoding="ascii")
    except OSError as error:
        fix = "run the helper, or the daemon as root: docs/feedback.md"
        raise InstallFailed(
            Problem("LAMP_UNREACHABLE", f"cannot be set ({error.strerror})", lamp.name, fix=fix)
        ) from error


def _have_trigger(lamp: Path, trigger: str) -> None:
    known = (lamp / "trigger").read_text(encoding="ascii").replace("[", " ").replace("]", " ")
    if trigger in known.split():
        (lamp / "trigger").write_text(trigger, encoding="ascii")
        return
    (lamp / "trigger").write_text("none", encoding="ascii")
    (lamp / "brightness").write_text("0", encoding="ascii")
    raise InstallFailed(
        Problem(
            "LAMP_TRIGGER",
            "the kernel cannot blink it so: it is dark instead",
            where=lamp.name,
            need=f"trigger {trigger}",
            have="it is not loaded",
            fix=f"`modprobe ledtrig-{trigger}`, and a line in /etc/modules-load.d for it",
        )
    )
