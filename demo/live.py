"""What a person sees while the demonstration runs: components, plan and tree, as they change."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from demo.robot import Robot

REDRAW_S = 0.1
MARKS = {"SUCCESS": ("✓", "green"), "FAILURE": ("✗", "red"), "RUNNING": ("▶", "yellow")}


class Says:
    """Tells a person what is going on, on standard error; silent when machines listen."""

    def __init__(self, *, is_shown: bool) -> None:
        self._console = Console(stderr=True, quiet=not is_shown, highlight=False)

    def __call__(self, sentence: str) -> None:
        self._console.print(f"[bold]{sentence}[/bold]")


@contextmanager
def view(robots: Sequence[Robot], *, is_shown: bool) -> Iterator[None]:
    """Draw robots on a terminal until the context ends; in a pipe, print what they tell. More of
    them may be added meanwhile."""
    if not is_shown:
        yield
        return
    stop = threading.Event()
    draw = _draw if sys.stderr.isatty() else _print
    thread = threading.Thread(target=draw, args=(robots, stop), daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(timeout=5.0)


def _draw(robots: Sequence[Robot], stop: threading.Event) -> None:
    console = Console(stderr=True)
    with Live(console=console, refresh_per_second=8, transient=True) as live:
        while not stop.wait(REDRAW_S):
            live.update(_pictures(robots))


def _print(robots: Sequence[Robot], stop: threading.Event) -> None:
    """The same news for a pipe: each sentence that a host tells, and each plan, once."""
    told, plans = dict[str, int](), dict[str, str]()
    while not stop.wait(REDRAW_S):
        for robot in tuple(robots):
            name = robot.name
            for sentence in robot.told_since(told.get(name, 0)):
                print(f"  {name}: {sentence}", file=sys.stderr)
            told[name] = robot.told_number()
            steps = " → ".join(step["action"].split(" ")[0] for step in _steps(robot.view))
            if steps and steps != plans.get(name):
                print(f"  {name} plans: {steps}", file=sys.stderr)
                plans[name] = steps


def _pictures(robots: Sequence[Robot]) -> Table | Group:
    """One beside the other."""
    if len(robots) == 1:
        return _picture(robots[0].view)
    row = Table(*(robot.name for robot in robots), box=None, expand=True)
    row.add_row(*(_picture(robot.view) for robot in robots))
    return row


def _picture(now: Mapping[str, Any]) -> Group:
    components = Table("component", "state", "can", box=None)
    for row in now.get("components", ()):
        components.add_row(row["component"], row["state"], ", ".join(row["behaviours"]))
    plan = Table("step", "action", "state", box=None)
    for step in _steps(now):
        plan.add_row(str(step["step"]), step["action"], step["state"])
    tree = Text("\n").join(_tree(now["tree"], 0)) if now.get("tree") else Text()
    told = Text("\n".join(row["text"] for row in now.get("told", ())[-4:]))
    parts = (("components", components), ("plan", plan), ("tree", tree), ("told", told))
    return Group(*(Panel(part, title=title, title_align="left") for title, part in parts))


def _steps(now: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return list(now.get("plan", {}).get("steps", ()))


def _tree(node: Mapping[str, Any], depth: int) -> list[Text]:
    mark, colour = MARKS.get(node["status"], ("·", "dim"))
    lines = [Text(f"{'  ' * depth}{mark} {node['name']}  {node['why'] or ''}", style=colour)]
    for child in node["children"]:
        lines += _tree(child, depth + 1)
    return lines
