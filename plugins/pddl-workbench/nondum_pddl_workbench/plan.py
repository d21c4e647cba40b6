"""The commands that look for a plan, or for why there is none."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import render
from nondum.cli.connection import Session, json_option
from nondum.cli.progress import ProgressLine
from nondum.sdk.errors import Problem
from nondum_pddl_workbench.files import FILE
from nondum_pddl_workbench.search import Limits, Outcome, Question, search_options

if TYPE_CHECKING:
    from nondum.planning.merge.domain import Merged


@click.command()
@click.argument("domain", type=FILE)
@click.argument("problem", type=FILE)
@search_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="File for the plan [default: standard output].",
)
@json_option
@click.pass_obj
def plan(
    session: Session,
    domain: Path,
    problem: Path,
    planner: str | None,
    timeout_s: float,
    memory_mb: int,
    output: Path | None,
) -> int:
    """Find a plan, and print it as the planning competitions write plans.

    Plans are checked before they are shown. Exits with 0: a plan, 10: the goal is true already,
    11: there is no plan, which is proved, 12: no planner found an answer, 2: bad input.

    \b
    Examples: nondum pddl plan domain.pddl problem.pddl
              nondum pddl plan --planner native --timeout 10 domain.pddl problem.pddl -o plan.txt
    """
    with ProgressLine(problem.name, is_wanted=not session.as_json) as show:
        question = Question(Limits(planner, timeout_s, memory_mb), show)
        read = question.read(domain, problem)
        outcome = question.outcome(read)
    if session.as_json:
        render.as_json({**_view(outcome), "seconds": question.seconds})
        return outcome.exit
    if outcome.answer in ("plan", "already true"):
        text = _plan_text(outcome, read.merged, question.seconds)
        if output is None:
            click.echo(text, nl=False)
        else:
            output.write_text(text, encoding="utf-8")
    if outcome.answer != "plan":
        click.echo(render.lines_of(_words(outcome)), err=True)
    return outcome.exit


@click.command()
@click.argument("domain", type=FILE)
@click.argument("problem", type=FILE)
@search_options
@json_option
@click.pass_obj
def why(
    session: Session,
    domain: Path,
    problem: Path,
    planner: str | None,
    timeout_s: float,
    memory_mb: int,
) -> int:
    """Say why a problem has no plan: what is missing, and what would lead to it.

    Exits with 11 once that is told, with 0 if there is a plan, 10: the goal is true already,
    12: no planner found an answer, 2: bad input.

    Example: nondum pddl why domain.pddl problem.pddl
    """
    from nondum.planning.explain.explain import explain

    with ProgressLine(problem.name, is_wanted=not session.as_json) as show:
        question = Question(Limits(planner, timeout_s, memory_mb), show)
        read = question.read(domain, problem)
        outcome = question.outcome(read)
    problems: tuple[Problem, ...] = ()
    if outcome.answer == "unsolvable":
        problems = explain(read.merged, read.facts, read.goal).problems()
    if session.as_json:
        told = [problem.to_dict() for problem in problems]
        render.as_json({**_view(outcome), "problems": told, "seconds": question.seconds})
        return outcome.exit
    click.echo(render.lines_of(_words(outcome)))
    for found in problems:
        render.sentence(str(found))
    return outcome.exit


def _view(outcome: Outcome) -> dict[str, Any]:
    """As plain data, empty fields left out."""
    kept = (
        ("answer", "steps", "cost") if outcome.answer in ("plan", "already true") else ("answer",)
    )
    data = asdict(outcome)
    del data["exit"]
    return {key: value for key, value in data.items() if value or key in kept}


def _plan_text(outcome: Outcome, merged: Merged, seconds: dict[str, float]) -> str:
    from nondum_pddl_workbench.ipc_plan import plan_lines

    effects = [action.effect for action in merged.domain.actions.values()]
    is_unit_cost = all(effect.cost == 1 and not effect.cost_functions for effect in effects)
    times = ", ".join(f"{phase} {took_s:.3f} s" for phase, took_s in seconds.items())
    by = f" by {outcome.planner}" if outcome.planner else ""
    lines = plan_lines(outcome.steps, outcome.cost, is_unit_cost=is_unit_cost)
    return f"{lines}; {times}{by}\n"


def _words(outcome: Outcome) -> str:
    match outcome.answer:
        case "plan":
            return f"there is a plan: {len(outcome.steps)} steps, found by {outcome.planner}"
        case "already true":
            return "the goal is true already"
        case "unsolvable" if outcome.proof == "relaxed":
            facts = ", ".join(f"({fact})" for fact in outcome.facts) or "the goal"
            return f"there is no plan: {facts} cannot be reached, even if nothing were ever undone"
        case "unsolvable":
            return f"there is no plan: {outcome.planner} has looked at all that can be reached"
        case _:
            return f"no planner found an answer: {outcome.reason}"
