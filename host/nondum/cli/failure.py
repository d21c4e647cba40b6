"""How a refusal is told on the command line: one line a problem, and an exit code."""

from __future__ import annotations

import click

from nondum.cli import render
from nondum.sdk.errors import ConfigRefused, FragmentRefused, HostUnreachable, NondumError, Problem

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
            tell_problem(problem)
    if isinstance(error, HostUnreachable):
        return EXIT_NO_DAEMON
    if isinstance(error, ConfigRefused | FragmentRefused):
        return EXIT_BAD_INPUT
    return EXIT_REFUSED


def tell_problem(problem: Problem, *, as_warning: bool = False) -> None:
    """Print a problem in words on standard error."""
    click.secho(
        "warning: " if as_warning else "error: ",
        fg="yellow" if as_warning else "red",
        nl=False,
        err=True,
    )
    click.echo(render.lines_of(str(problem)), err=True)
