"""How far something long is: one line, written over on a terminal; nothing elsewhere."""

from __future__ import annotations

import sys
from types import TracebackType

import click

from nondum.host.core.printable import printable


class ProgressLine:
    """Shows phases of one thing; use it as a context, which clears the line at its end."""

    def __init__(self, name: str, *, is_wanted: bool) -> None:
        self._name = name
        self._is_shown = is_wanted and sys.stderr.isatty()

    def __call__(self, phase: str, done: int, total: int) -> None:
        """Show that `done` of `total` steps, or bytes, of a phase are through."""
        if self._is_shown:
            share = f" {100 * done // total} %" if total else ""
            self._write(printable(f"{self._name}: {phase}{share}"))

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._is_shown:
            self._write("")

    def _write(self, text: str) -> None:
        click.echo(f"\r\x1b[K{text}", nl=False, err=True)
