"""Commands that other distributions bring: entry points of the group `nondum.commands`.

Each names a command of click. The one-line help of a command is the summary of its distribution,
so that `nondum --help` imports none of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import EntryPoint, entry_points

import click

from nondum.sdk.errors import ConfigRefused, Problem

GROUP = "nondum.commands"


@cache
def installed_commands() -> Mapping[str, EntryPoint]:
    """Those of this environment, by their names."""
    return {entry.name: entry for entry in entry_points(group=GROUP)}


def summary(entry: EntryPoint) -> str:
    """The one-line help."""
    return entry.dist.metadata["Summary"] if entry.dist is not None else ""


def load(entry: EntryPoint) -> click.Command:
    """Import a command. Raises `ConfigRefused` (EXTENSION_BROKEN)."""
    try:
        command = entry.load()
    except Exception as error:
        raise _broken(entry, f"{type(error).__name__}: {error}") from error
    if not isinstance(command, click.Command):
        raise _broken(entry, f"{entry.value} is not a command of click")
    return command


def _broken(entry: EntryPoint, why: str) -> ConfigRefused:
    text = f"the command {entry.name} does not work: {why}"
    return ConfigRefused(Problem("EXTENSION_BROKEN", text, where=entry.value))
