"""One live screen of a host, drawn over itself until a person has enough."""

from __future__ import annotations

import contextlib
import os
import select
import shutil
import signal
import sys
import termios
import threading
import time
import tty
from collections.abc import Generator, Iterator
from typing import Any, NoReturn

import click

from nondum.cli import live, render
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.cli.watch_screen import screen, waiting
from nondum.sdk.errors import HostUnreachable, NondumError

EVERY_S = 2
"""The host tells how it is at least so often: load and rates change by themselves."""
LOOK_S = 1.0
"""The clock on the screen goes on, and the screen is as big as the terminal, at least so often."""
DRAWN_S = 0.1
"""Between two drawings, however much happens."""
RETRY_S = 0.5
"""Between two tries to find a host that has gone."""
_OPENED, _CLOSED = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"
"""The terminal's other screen, without a cursor; and back (xterm's control sequences)."""


@click.command()
@json_option
@click.pass_obj
def watch(session: Session) -> None:
    """One live screen: what is wrong, goals, plan, parts, streams.

    It is drawn in place as the host changes, until q or Ctrl-C. A host that goes is waited for.
    Where output is no terminal it is printed once.

    Example: nondum watch
    """
    views = session.follow("watch", every_s=EVERY_S)
    first = next(views)
    if session.as_json:
        render.as_json(first)
    elif not live.is_screen():
        lines = screen(first, width=None, height=None, wall_s=time.time())
        click.echo("\n".join(lines))
    else:
        with contextlib.suppress(KeyboardInterrupt), _full_screen():
            _show(_News(session, first, views))


class _News:
    """The latest view, taken in by a thread: the person at the keyboard is not kept waiting."""

    def __init__(self, session: Session, first: dict[str, Any], views: Generator[Any]) -> None:
        self._session = session
        self.view: dict[str, Any] | None = first
        """None: no host answers."""
        self.name = first["host"]
        self.since_s = time.time()
        """When it was taken in, or the host was missed, in seconds since the epoch."""
        self.error: NondumError | None = None
        self.is_new, self._tell = os.pipe()
        """Readable when there is something new."""
        threading.Thread(target=self._take_in, args=(views,), daemon=True).start()

    def _take_in(self, views: Generator[Any]) -> None:
        try:
            while True:
                with contextlib.suppress(HostUnreachable):
                    for view in views:
                        self._take(view)
                if self.view is not None:
                    self._take(None)
                time.sleep(RETRY_S)
                views = self._session.follow("watch", every_s=EVERY_S)
        except NondumError as error:
            self.error = error
            os.write(self._tell, b".")

    def _take(self, view: dict[str, Any] | None) -> None:
        self.view, self.since_s = view, time.time()
        os.write(self._tell, b".")

    def lines(self) -> list[str]:
        """What is to be shown now."""
        size, wall_s, view = shutil.get_terminal_size(), time.time(), self.view
        if view is None:
            return waiting(self.name, width=size.columns, wall_s=wall_s, since_s=self.since_s)
        return screen(
            view,
            width=size.columns,
            height=size.lines - 1,
            wall_s=wall_s,
            quiet_s=wall_s - self.since_s,
        )


def _show(news: _News) -> None:
    """Draw until q is typed. Raises `NondumError` with what the host refuses."""
    inputs = [news.is_new, *([sys.stdin.fileno()] if sys.stdin.isatty() else [])]
    while news.error is None:
        live.draw(news.lines())
        ready, _, _ = select.select(inputs, [], [], LOOK_S)
        if sys.stdin.fileno() in ready and b"q" in os.read(sys.stdin.fileno(), 64).lower():
            return
        if news.is_new in ready:
            os.read(news.is_new, 4096)
            time.sleep(DRAWN_S)
    raise news.error


@contextlib.contextmanager
def _full_screen() -> Iterator[None]:
    """The terminal's other screen, and keys without Enter; all as it was at the end."""
    before = termios.tcgetattr(sys.stdin) if sys.stdin.isatty() else None
    was = signal.signal(signal.SIGTERM, _end)  # by default, the terminal would stay as it is
    try:
        if before is not None:
            tty.setcbreak(sys.stdin)
        sys.stdout.write(_OPENED)
        yield
    finally:
        sys.stdout.write(_CLOSED)
        sys.stdout.flush()
        if before is not None:
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        signal.signal(signal.SIGTERM, was)


def _end(number: int, _: object) -> NoReturn:
    raise SystemExit(128 + number)
