"""The command that merges the fragments of components."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import render
from nondum.cli.connection import Session, json_option
from nondum.cli.failure import EXIT_PROBLEMS, tell_problem
from nondum.sdk.errors import FragmentRefused, GoalRefused, Problem
from nondum_pddl_workbench.fragments import HOST, Owned, contributions_of, unit_option

if TYPE_CHECKING:
    from nondum.planning.merge.contribution import Contribution
    from nondum.planning.merge.domain import Merged, Origin
    from nondum.sdk.planner import PddlTask


@click.command()
@click.argument(
    "components",
    metavar="FILE|DIR…",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path, exists=True),
)
@unit_option
@click.option("--goal", default="(and)", help="What the problem asks for, in PDDL.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder for domain.pddl and problem.pddl [default: standard output].",
)
@json_option
@click.pass_obj
def merge(
    session: Session,
    components: tuple[Path, ...],
    units: tuple[Owned, ...],
    goal: str,
    output: Path | None,
) -> int:
    """Merge fragments as a host does; each FILE, or DIR with *.pddl files, is one component.

    A DIR may also be a payload; then its units are known. Exits with 3 when a component had to be
    left out; which, and why, is told on standard error, and so are warnings.

    \b
    Examples: nondum pddl merge eye.pddl arm.pddl
              nondum pddl merge eye/ arm/ --unit eye:left=camera --goal '(seen person self)' -o both
    """
    from nondum.planning.merge.merge import merge as merged_of

    contributions = _all(components, units)
    merged = merged_of(contributions, HOST)
    task = _task(merged, contributions, goal)
    if session.as_json:
        render.as_json(_view(merged, task))
    else:
        _tell(merged, task, output)
    return EXIT_PROBLEMS if merged.quarantined else 0


def _all(paths: Iterable[Path], units: Sequence[Owned]) -> list[Contribution]:
    """Raises `FragmentRefused` (PDDL_TWICE) when two components have one name."""
    found: dict[str, Contribution] = {}
    for path in paths:
        for contribution in contributions_of(path, units):
            if contribution.component in found:
                message = f"a second component {contribution.component!r}"
                fix = "rename the file or folder: components are called after them"
                raise FragmentRefused(Problem("PDDL_TWICE", message, where=str(path), fix=fix))
            found[contribution.component] = contribution
    return list(found.values())


def _task(merged: Merged, contributions: Iterable[Contribution], goal: str) -> PddlTask:
    """What a planner would be asked while everything is at rest."""
    from nondum.planning.ground.pddl_text import pddl_text
    from nondum.planning.merge.goal import parse_goal
    from nondum.planning.pddl.wording import without_dots

    try:
        wanted = parse_goal(goal, merged).expr
    except GoalRefused as refused:
        raise FragmentRefused(*refused.problems) from refused
    here = (c for c in contributions if c.component not in merged.quarantined)
    facts = {*merged.init, f"self {HOST}", *(fact for c in here for fact in c.body_facts())}
    return pddl_text(merged, facts, wanted, spelled=without_dots)


def _tell(merged: Merged, task: PddlTask, output: Path | None) -> None:
    for component, problems in merged.quarantined.items():
        click.secho(f"left out: {component}", fg="red", err=True)
        for problem in problems:
            tell_problem(problem)
    for warning in merged.warnings:
        tell_problem(warning, as_warning=True)
    if output is None:
        click.echo(f"{task.domain}\n{task.problem}", nl=False)
        return
    output.mkdir(parents=True, exist_ok=True)
    for name, text in (("domain.pddl", task.domain), ("problem.pddl", task.problem)):
        (output / name).write_text(text, encoding="utf-8")
        click.echo(str(output / name))


def _view(merged: Merged, task: PddlTask) -> dict[str, Any]:
    """Everything with who brought it."""
    domain = merged.domain
    return {
        "domain": task.domain,
        "problem": task.problem,
        "types": {n: _told(o) for n, o in domain.type_origins.items()},
        "predicates": {n: _told(p.origins) for n, p in domain.predicates.items()},
        "functions": {n: _told(f.origins) for n, f in domain.functions.items()},
        "actions": {n: _told(a.origins) for n, a in domain.actions.items()},
        "objects": {n: _told(o.origins) for n, o in merged.objects.items()},
        "facts": {text: _told(origins) for text, origins in merged.init.items()},
        "parked": {text: _told(origins) for text, origins in merged.parked.items()},
        "quarantined": {
            component: [problem.to_dict() for problem in problems]
            for component, problems in merged.quarantined.items()
        },
        "warnings": [warning.to_dict() for warning in merged.warnings],
    }


def _told(origins: Iterable[Origin]) -> list[str]:
    return [str(origin) for origin in origins]
