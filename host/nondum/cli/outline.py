"""A behaviour tree as indented lines: what each node does, and why it is where it is."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import click

from nondum.cli import render
from nondum.host.core.printable import printable

Node = Mapping[str, Any]

NARROWEST = 30
"""Characters that a line keeps, however deep it stands."""

STATUS_MARK = {"SUCCESS": "✓", "FAILURE": "✗", "RUNNING": "▶", "INVALID": "·"}
STATUS_COLOUR = {"SUCCESS": "green", "FAILURE": "red", "RUNNING": "yellow"}
STEP_MARK = {
    "done": "✓",
    "skipped": "↷",
    "running": "▶",
    "kept": "∞",
    "halting": "■",
    "next": "›",
    "waiting": "·",
    "excluded": "✗",
}
STEP_COLOUR = {
    "done": "green",
    "skipped": "green",
    "running": "yellow",
    "kept": "cyan",
    "halting": "magenta",
    "next": "yellow",
    "excluded": "red",
}


def outline(node: Node, *, width: int | None = None, depth: int = 0) -> list[str]:
    """The lines of a tree, folded to a width if one is given."""
    if step := node.get("step"):
        return list(_step_lines(node, step, width, depth))
    status = str(node["status"])
    mark = click.style(STATUS_MARK.get(status, "·"), fg=STATUS_COLOUR.get(status))
    head = _with_why(str(node["name"]), node.get("why"))
    lines = list(_hanging(head, width, depth, mark))
    if task := node.get("task"):
        for text in _task_details(task):
            lines += _hanging(text, width, depth + 1)
    for child in node.get("children", ()):
        lines += outline(child, width=width, depth=depth + 1)
    return lines


def _with_why(name: str, why: Any) -> str:
    return f"{name}  — {why}" if why else name


def _task_details(task: Mapping[str, Any]) -> Iterator[str]:
    if "goal" in task:
        cost = f"; the plan costs {task['cost']}"
        yield f"{task['kind']} {task['goal']}{cost if task['steps'] else ''}"
    if task["excluded"]:
        yield f"left out for a while, after failing too often: {', '.join(task['excluded'])}"


def _step_lines(node: Node, step: Node, width: int | None, depth: int) -> Iterator[str]:
    state = str(step["state"])
    mark = click.style(STEP_MARK.get(state, "·"), fg=STEP_COLOUR.get(state))
    head = f"{step['number']} {step['schema']}  {state}{_time(step)}"
    yield from _hanging(_with_why(head, _more_than_state(node, step)), width, depth, mark)
    for label, text in step_details(step):
        yield from _hanging(f"{label}: {text}", width, depth + 2)


def _more_than_state(node: Node, step: Node) -> str:
    """Why a step is where it is, as far as neither its state nor the lines below say it."""
    state, why = step["state"], str(node["why"])
    if state == "kept" or (state == "waiting" and step["waits_for"]):
        return ""
    return why.removeprefix("is ").removeprefix(state).removeprefix(": ")


def step_details(step: Node) -> Iterator[tuple[str, str]]:
    """What there is to say of a step beside its state: a label and words for each."""
    bound = ", ".join(f"{name}={value}" for name, value in step["arguments"].items())
    yield "with", bound or "nothing"
    if step["progress"]:
        yield "progress", step["progress"]
    if step["waits_for"]:
        yield "waits for", "; ".join(_waits(*of) for of in by_step(step["waits_for"]))
    if step["needed_by"]:
        label = "kept for" if step["state"] == "kept" else "needed by"
        yield label, "; ".join(_need(*of) for of in by_step(step["needed_by"]))
    if step["state"] not in ("done", "skipped") and (locks := _locks(step)):
        yield "locks", locks
    yield "chosen", _chosen(step["chosen"])


def _time(step: Node) -> str:
    if step["started"] is None:
        return ""
    since = render.clock(step["started"]).split(" ")[1]
    return f" {'since' if step['ended'] is None else 'at'} {since}, {duration(step['runs_s'])}"


def duration(seconds: float) -> str:
    """A time as people read it.

    >>> duration(0.25), duration(12.0), duration(75.0), duration(7384.0)
    ('0.2 s', '12 s', '1 min 15 s', '2 h 3 min')
    """
    if seconds < 10.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def by_step(rows: Iterable[Node]) -> Iterator[tuple[int | None, str]]:
    """The facts of causal links by the step (None: the goal) at their other end.

    >>> list(by_step([{"step": 2, "fact": "a b"}, {"step": 2, "fact": "c"}]))
    [(2, '(a b), (c)')]
    """
    facts: dict[int | None, list[str]] = {}
    for row in rows:
        facts.setdefault(row["step"], []).extend([f"({row['fact']})"] if row["fact"] else [])
    return ((step, ", ".join(found)) for step, found in facts.items())


def _waits(step: int | None, facts: str) -> str:
    return f"{facts} of step {step}" if facts else f"the end of step {step}"


def _need(step: int | None, facts: str) -> str:
    return f"{'the goal' if step is None else f'step {step}'}: {facts}"


def _locks(step: Node) -> str:
    locks, found = step["locks"], []
    if locks["unit"]:
        owner = f" of {step['component']}" if step["component"] else ""
        found.append(f"{locks['unit']}{owner}, which serves one at a time")
    if locks["takes"]:
        meanwhile = "while it runs" if step["lasting"] else "once it has run"
        found.append(f"no {', '.join(f'({fact})' for fact in locks['takes'])} {meanwhile}")
    return "; ".join(found)


def _chosen(chosen: Node) -> str:
    text = str(chosen["why"])
    if others := [_other(row) for row in chosen["instead_of"]]:
        text += f"{_rank(chosen)}; instead of {', '.join(others)}"
    if chosen["excluded"]:
        text += f"; left out for failing: {', '.join(chosen['excluded'])}"
    return text


def _other(row: Node) -> str:
    schema, owner = row["action"].split(" ")[0], row["component"]
    return f"{schema}{f' of {owner}' if owner else ''} (cost {row['cost']}{_rank(row)})"


def _rank(row: Node) -> str:
    return "" if row["rank"] is None else f", rank {row['rank']}"


def _hanging(text: str, width: int | None, depth: int, mark: str = "") -> Iterator[str]:
    """Words of strangers under a mark: the lines after the first stand a little further in."""
    indent, text = "  " * depth, printable(text)
    first = f"{indent}{mark} " if mark else indent
    if width is None:
        yield f"{first}{text}"
        return
    hanging = f"{indent}{'    ' if mark else '  '}"
    space = max(NARROWEST, width - len(hanging))
    folded = textwrap.wrap(text, space, break_on_hyphens=False) or [""]
    yield f"{first}{folded[0]}"
    yield from (f"{hanging}{line}" for line in folded[1:])
