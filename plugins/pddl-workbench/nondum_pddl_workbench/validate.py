"""The command that checks a plan."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import click

from nondum.cli import render
from nondum.cli.connection import Session, json_option
from nondum.cli.failure import EXIT_PROBLEMS, tell_problem
from nondum.sdk.errors import Problem
from nondum_pddl_workbench.files import FILE, loaded, text_of

_CLAIM = re.compile(r"^\s*;\s*cost\s*=\s*([0-9]+)", re.MULTILINE | re.IGNORECASE)


@click.command()
@click.argument("domain", type=FILE)
@click.argument("problem", type=FILE)
@click.argument("plan", type=FILE)
@json_option
@click.pass_obj
def validate(session: Session, domain: Path, problem: Path, plan: Path) -> int:
    """Check a plan step by step, as any planner wrote it, on the actions as they are written.

    Comments, upper case, times beside the steps and a last (reach-goal) do no harm. Exits with
    0: it reaches the goal, 3: it does not, 2: bad input.

    Example: nondum pddl validate domain.pddl problem.pddl sas_plan
    """
    from nondum_pddl_workbench.ipc_plan import PSEUDO_STEPS, read_plan
    from nondum_pddl_workbench.rehearsal import rehearsed

    read = loaded(domain, problem)
    for warning in read.warnings:
        tell_problem(warning, as_warning=True)
    text = text_of(plan)
    steps = read_plan(text, str(plan))
    if steps and steps[-1].name in PSEUDO_STEPS - read.merged.domain.actions.keys():
        steps = steps[:-1]
    found = rehearsed(read.merged, read.facts, read.goal, [step.name for step in steps])
    place = str(steps[found.taken].place) if found.taken < len(steps) else str(plan)
    problems = [replace(one, where=place) for one in found.problems]
    claimed = _CLAIM.search(text)
    if not problems and claimed and int(claimed[1]) != found.cost:
        message = "the cost is not the sum of its steps"
        have = str(found.cost)
        problems.append(Problem("PLAN_COST", message, str(plan), claimed[1], have))
    return _tell(session, problems, len(steps), found.cost)


def _tell(session: Session, problems: list[Problem], steps: int, cost: int) -> int:
    if session.as_json:
        told = [problem.to_dict() for problem in problems]
        render.as_json({"valid": not problems, "steps": steps, "cost": cost, "problems": told})
    elif problems:
        for problem in problems:
            render.sentence(str(problem), colour="red")
        click.echo("invalid")
    else:
        click.echo(f"valid: {steps} steps, cost = {cost}")
    return EXIT_PROBLEMS if problems else 0
