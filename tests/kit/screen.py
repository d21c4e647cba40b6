"""A terminal with a person before it: what stands on its screen while a command runs there."""

from __future__ import annotations

import codecs
import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import termios
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from demo.robot import TooLate
from tests.kit.command_line import clean_environment, command
from tests.kit.until import PATIENCE_S

_PART = re.compile(r"\x1b\[([?0-9;]*)([a-zA-Z])|(\r)|(\n)|([^\x1b\r\n]+)")

_CUT = re.compile(r"\x1b(\[[?0-9;]*)?$")
"""A sequence of which the rest has not been read yet."""


class Screen:
    """As much of a terminal (ECMA-48) as `nondum` uses; anything else is an error."""

    def __init__(self, columns: int, lines: int) -> None:
        self.columns, self._rows = columns, [""] * lines
        self._row = self._column = 0
        self.is_other = False
        """Whether the other screen is shown, which leaves no trace when it is closed."""
        self.coloured = False
        """Whether anything had a colour."""

    @property
    def lines(self) -> list[str]:
        """What is seen, without the empty end."""
        return "\n".join(row.rstrip() for row in self._rows).rstrip().split("\n")

    def feed(self, text: str) -> None:
        """Take in what a command writes; nothing is cut within a sequence."""
        position = 0
        while position < len(text):
            part = _PART.match(text, position)
            assert part, f"what is {text[position : position + 8]!r}?"
            position = part.end()
            numbers, verb, to_start, to_next, words = part.groups()
            if verb:
                self._do(numbers, verb)
            elif to_start:
                self._column = 0
            elif to_next:
                self._next_line()
            else:
                self._write(words)

    def _do(self, numbers: str, verb: str) -> None:
        match numbers, verb:
            case (("" | "1;1"), "H"):
                self._row = self._column = 0
            case (("" | "0"), "K"):
                self._rows[self._row] = self._rows[self._row][: self._column]
            case (("" | "0"), "J"):
                self._rows[self._row] = self._rows[self._row][: self._column]
                self._rows[self._row + 1 :] = [""] * (len(self._rows) - self._row - 1)
            case "?1049", ("h" | "l"):
                self.is_other = verb == "h"
                self._rows, self._row, self._column = [""] * len(self._rows), 0, 0
            case "?25", _:
                pass
            case _, "m":
                self.coloured |= bool(re.search(r"3[0-7]", numbers))
            case _:
                raise AssertionError(f"what is {numbers}{verb}?")

    def _write(self, words: str) -> None:
        assert self._column + len(words) <= self.columns, f"too long for the screen: {words!r}"
        row = self._rows[self._row].ljust(self._column)
        self._rows[self._row] = row[: self._column] + words + row[self._column + len(words) :]
        self._column += len(words)

    def _next_line(self) -> None:
        if self._row == len(self._rows) - 1:
            self._rows = [*self._rows[1:], ""]
        else:
            self._row += 1


class Terminal:
    """A command at work in a terminal."""

    def __init__(self, process: subprocess.Popen[bytes], end: int, screen: Screen) -> None:
        self.process, self.screen = process, screen
        self._end = end
        self._decoder = codecs.getincrementaldecoder("utf-8")()
        self._unread = ""

    def press(self, keys: str) -> None:
        """Press keys."""
        os.write(self._end, keys.encode())

    def until(self, *words: str, without: str = "") -> list[str]:
        """Read on until all of these stand on the screen at once; gives its lines."""
        end_s = time.monotonic() + PATIENCE_S
        while not self._shows(words, without):
            if not self._read(end_s - time.monotonic()):
                seen = "\n".join(self.screen.lines)
                raise TooLate(f"{words} are not on the screen, which shows\n{seen}")
        return self.screen.lines

    def ended(self) -> int:
        """Read to the end; gives the command's exit code."""
        while self._read(PATIENCE_S):
            pass
        return self.process.wait(PATIENCE_S)

    def resize(self, columns: int, lines: int) -> None:
        """Make it another size; nothing is shown until the command draws again."""
        self.screen = Screen(columns, lines)
        _set_size(self._end, columns, lines)

    @property
    def has_echo(self) -> bool:
        """Whether keys are shown as they are pressed, as in a shell."""
        return bool(termios.tcgetattr(self._end)[3] & termios.ECHO)

    def _shows(self, words: Sequence[str], without: str) -> bool:
        is_there = all(any(word in line for line in self.screen.lines) for word in words)
        return is_there and not (without and without in "\n".join(self.screen.lines))

    def _read(self, patience_s: float) -> bool:
        ready, _, _ = select.select([self._end], [], [], max(0.0, patience_s))
        if not ready:
            return False
        try:
            self._unread += self._decoder.decode(os.read(self._end, 65536))
        except OSError:  # EIO: no process has the other end open any more (pty(7))
            return False
        cut = _CUT.search(self._unread)
        whole = cut.start() if cut else len(self._unread)
        self.screen.feed(self._unread[:whole])
        self._unread = self._unread[whole:]
        return True


@contextmanager
def terminal(
    *arguments: str | Path, columns: int = 80, lines: int = 24, **environment: str
) -> Iterator[Terminal]:
    """Run `nondum` in a terminal of a size, for as long as the context lasts."""
    ours, theirs = pty.openpty()
    _set_size(ours, columns, lines)
    own_size = {name: "" for name in ("COLUMNS", "LINES")}  # not that of who runs the tests
    process = subprocess.Popen(
        command(*arguments),
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=clean_environment() | {"TERM": "xterm"} | own_size | environment,
        start_new_session=True,
    )
    os.close(theirs)
    with process:
        try:
            yield Terminal(process, ours, Screen(columns, lines))
        finally:
            process.kill()
            os.close(ours)


def _set_size(end: int, columns: int, lines: int) -> None:
    fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
