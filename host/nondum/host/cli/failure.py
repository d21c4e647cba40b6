"""How a refusal is told on the command line: one line a problem, and an exit code."""

from __future__ import annotations

import click

from nondum.sdk.errors import ConfigRefused, HostUnreachable, NondumError

EXIT_REFUSED = 1
EXIT_BAD_INPUT = 2
EXIT_PROBLEMS = 3
EXIT_NO_DAEMON = 4


def tell(error: NondumError) -> int:
    """Print the problems on standard error and return the exit code."""
    for problem in error.problems:
        click.secho("error: ", fg="red", nl=False, err=True)
        click.echo(str(problem), err=True)
    if isinstance(error, HostUnreachable):
        return EXIT_NO_DAEMON
    if isinstance(error, ConfigRefused):
        return EXIT_BAD_INPUT
    return EXIT_REFUSED
