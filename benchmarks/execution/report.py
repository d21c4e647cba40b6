"""The page that a run writes, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from textwrap import fill

from benchmarks import measuring
from benchmarks.execution.results import Figures, Results
from benchmarks.execution.ticking import LENGTHS
from benchmarks.execution.trial import EXECUTORS
from benchmarks.execution.troubles import EVERYTHING, KINDS
from benchmarks.measuring import Spread, table

OURS = next(iter(EXECUTORS))
WIDTH = 100
HEAD = ["reached", "false", "stuck", "actions ÷ plan", "plans", "µs per tick (10-90 %)"]


def as_markdown(results: Results, ticks: dict[str, dict[int, Spread]], seeds: int) -> str:
    """All but the title and the method."""
    sections = {
        "Reading": _list(_reading(results, ticks)),
        "Rates": _list(f"**{kind}**: {rates}" for kind, rates in KINDS.items()),
        f"All troubles at once, {seeds} runs each": _by_scene(results),
        "One trouble at a time, all domains": _by_trouble(results),
        "A tick by the length of the plan": _ticks(ticks),
        "Machine": f"{measuring.machine()}; {seeds} seeds.",
    }
    return "\n".join(f"## {title}\n\n{body}\n" for title, body in sections.items())


def _list(lines: Iterable[str]) -> str:
    return "\n".join(fill(f"- {line}", WIDTH, subsequent_indent="  ") for line in lines)


def _reading(results: Results, ticks: dict[str, dict[int, Spread]]) -> Iterator[str]:
    """What the tables say, in sentences made of them."""
    overall = {executor: results.of(executor) for executor in EXECUTORS}
    for executor, found in overall.items():
        yield (
            f"**{executor}** reached the goal in {found.reached} of {found.runs} runs, claimed so "
            f"falsely in {found.false} and was stuck in {found.stuck}; it took {found.actions:.2f} "
            f"times the plan's actions and {found.plans:.1f} plans a run."
        )
    calm = {executor: results.of(executor, trouble="none") for executor in EXECUTORS}
    if failing := [
        f"{name} {f.runs - f.reached}" for name, f in calm.items() if f.reached < f.runs
    ]:
        runs = calm[OURS].runs
        yield f"Even where nothing goes wrong, of {runs} runs some fail: {', '.join(failing)}."
    took = ", ".join(f"{executor} {found.tick_us:.0f}" for executor, found in overall.items())
    yield f"Here every moment brings news, so that every tick decides; medians in µs: {took}."
    longest = LENGTHS[-1]
    quiet, busy, changed, *_ = (lengths[longest].median for lengths in ticks.values())
    yield (
        f"A task tree of {longest} steps is ticked in {quiet:.1f} µs while nothing is new, in "
        f"{busy:.1f} µs if the news is about something else, and in {changed:.0f} µs if it has to "
        "decide again: once for each piece of news that matters, not at each tick."
    )


def _by_scene(results: Results) -> str:
    rows = [
        [f"{scene} ({length} steps)", executor, *_row(results.of(executor, **of))]
        for scene, length in results.lengths()
        for executor in EXECUTORS
        for of in [{"scene": scene, "trouble": EVERYTHING}]
    ]
    return table(["domain", "executor", *HEAD], rows)


def _by_trouble(results: Results) -> str:
    rows = [
        [trouble, executor, *_row(results.of(executor, trouble=trouble))]
        for trouble in KINDS
        for executor in EXECUTORS
    ]
    return table(["what goes wrong", "executor", *HEAD], rows)


def _row(found: Figures) -> list[str]:
    return [
        f"{found.reached} of {found.runs}",
        str(found.false),
        str(found.stuck),
        f"{found.actions:.2f}",
        f"{found.plans:.1f}",
        f"{found.tick_us:.0f} ({found.quick_us:.0f}-{found.slow_us:.0f})",
    ]


def _ticks(ticks: dict[str, dict[int, Spread]]) -> str:
    head = ["µs per tick", *(f"{length} steps" for length in LENGTHS)]
    rows = [
        [way, *(format(lengths[length], ".1f") for length in LENGTHS)]
        for way, lengths in ticks.items()
    ]
    return table(head, rows)
