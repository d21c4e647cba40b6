"""The group `nondum pddl`; none of its commands needs a host."""

from __future__ import annotations

import click

from nondum_pddl_workbench.check import check
from nondum_pddl_workbench.merge import merge
from nondum_pddl_workbench.plan import plan, why
from nondum_pddl_workbench.validate import validate


@click.group()
def pddl() -> None:
    """Check, merge and plan PDDL files, without a host.

    Example: nondum pddl plan domain.pddl problem.pddl
    """


for command in (check, merge, plan, validate, why):
    pddl.add_command(command)
