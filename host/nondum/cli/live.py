"""What goes on being shown: `--follow` and `--since`, and a screen that is drawn over itself."""

from __future__ import annotations

import io
import os
import re
import shutil
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from typing import Any, TypeVar

import click

_F = TypeVar("_F", bound=Callable[..., Any])

_TO_HOME, _TO_LINE_END, _TO_SCREEN_END = "\x1b[H", "\x1b[K", "\x1b[J"
_AGO = re.compile(r"(\d+)\s*([a-z]*)")
_UNITS = {
    "s": ("", "s", "sec", "second", "seconds"),
    "min": ("m", "min", "minute", "minutes"),
    "h": ("h", "hour", "hours"),
    "d": ("d", "day", "days"),
}
_SECONDS = {"s": 1, "min": 60, "h": 3600, "d": 86_400}
_LONGEST_S = 100 * 365 * 86_400


def follow_option(help: str, *older_names: str) -> Callable[[_F], _F]:
    """Add `--follow`."""
    return click.option("--follow", "-f", *older_names, "follow", is_flag=True, help=help)


REDRAWN = "Show it again whenever it changes, in the same place on a terminal."
APPENDED = "Then go on with what comes, until Ctrl-C."


def since_option(command: _F) -> _F:
    """Add `--since`."""
    return click.option(
        "--since",
        "since_s",
        metavar="TIME",
        callback=_ago,
        help="Only what is not older, for example 30s, 10min, 2h or 1d.",
    )(command)


def _ago(ctx: click.Context, param: click.Parameter, value: str | None) -> int | None:
    if value is None:
        return None
    seconds = seconds_of(value)
    if seconds is None:
        wrong = f"{value!r} is no time: say for example 30s, 10min, 2h or 1d"
        raise click.BadParameter(wrong, ctx, param)
    return seconds


def seconds_of(text: str) -> int | None:
    """A time as people type it, in seconds; None: it is none.

    >>> seconds_of("10min"), seconds_of("2 h"), seconds_of("1h 30min"), seconds_of("90")
    (600, 7200, 5400, 90)
    >>> seconds_of("soon"), seconds_of("0s"), seconds_of("3 fortnights")
    (None, None, None)
    """
    words, seconds = text.strip().casefold(), 0
    while words:
        found = _AGO.match(words)
        unit = found and next((unit for unit in _UNITS if found[2] in _UNITS[unit]), None)
        if not found or not unit:
            return None
        seconds += int(found[1]) * _SECONDS[unit]
        words = words[found.end() :].lstrip()
    return seconds if 0 < seconds <= _LONGEST_S else None


def is_screen() -> bool:
    """Whether output goes to a terminal that can be drawn over."""
    return sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def redraw(show: Callable[[], object]) -> None:
    """Show what `show` prints: over what the terminal shows now, below it anywhere else."""
    if not is_screen():
        show()
        click.echo()
        return
    draw(_printed(show))


def draw(lines: Sequence[str]) -> None:
    """The lines over what the terminal shows, without blanking it first; what does not fit is
    counted."""
    space = shutil.get_terminal_size().lines - 1
    if len(lines) > space:
        lines = [*lines[: space - 1], f"… {len(lines) - space + 1} more lines"]
    shown = "".join(f"{line}{_TO_LINE_END}\n" for line in map(_as_wanted, lines))
    sys.stdout.write(f"{_TO_HOME}{shown}{_TO_SCREEN_END}")
    sys.stdout.flush()


def _as_wanted(line: str) -> str:
    """Without colour, where none is wanted: click would leave out what moves the cursor, too."""
    return click.unstyle(line) if click.get_current_context().color is False else line


class _Printed(io.StringIO):
    def isatty(self) -> bool:
        return True  # it is shown on a terminal


def _printed(show: Callable[[], object]) -> list[str]:
    with redirect_stdout(_Printed()) as printed:
        show()
    return printed.getvalue().splitlines()
