"""Commands for PDDL files; none needs a host."""

from __future__ import annotations

import click

from nondum.cli.pddl_check import check
from nondum.cli.pddl_merge import merge
from nondum.cli.pddl_plan import plan, why
from nondum.cli.pddl_validate import validate


@click.group()
def pddl() -> None:
    """Check, merge and plan PDDL files, without a host.

    Example: nondum pddl plan domain.pddl problem.pddl
    """


for command in (check, merge, plan, validate, why):
    pddl.add_command(command)
