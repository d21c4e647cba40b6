"""How a refusal is told on the command line: one line a problem, and an exit code."""

from __future__ import annotations

import click

from nondum.host.cli import render
from nondum.sdk.errors import ConfigRefused, HostUnreachable, NondumError

EXIT_REFUSED = 1
EXIT_BAD_INPUT = 2
EXIT_PROBLEMS = 3
EXIT_NO_DAEMON = 4
EXIT_INTERRUPTED = 130
EXIT_BROKEN_PIPE = 141


def tell(error: NondumError, *, as_json: bool = False) -> int:
    """Print the problems, in JSON on standard output or in words on standard error, and return the
    exit code."""
    if as_json:
        render.as_json({"problems": [problem.to_dict() for problem in error.problems]})
    else:
        for problem in error.problems:
            click.secho("error: ", fg="red", nl=False, err=True)
            click.echo(render.lines_of(str(problem)), err=True)
    if isinstance(error, HostUnreachable):
        return EXIT_NO_DAEMON
    if isinstance(error, ConfigRefused):
        return EXIT_BAD_INPUT
    return EXIT_REFUSED
