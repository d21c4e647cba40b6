"""The page that a run writes, in Markdown."""

from __future__ import annotations

import os
import statistics
from collections.abc import Iterable, Iterator
from textwrap import fill

from benchmarks import measuring
from benchmarks.measuring import table
from benchmarks.planning.results import Results, middle

WIDTH = 100
OURS = ("native", "portfolio")
PHASES = ("grammar", "parse", "ground", "search")
WITHIN_S = (0.5, 1.0, 2.0)


def as_markdown(results: Results, limit_s: float, versions: str) -> str:
    """All but the title and the method."""
    sections = {
        "Reading": _list(_reading(results, limit_s)),
        "All problems": _overall(results, limit_s),
        "Time by phase": _phases(results),
        "Solved, by domain": _by_group(results),
        "Median seconds of what was solved, by domain": _seconds(results),
        "Who was wrong, and what was refused": _wrong(results),
        "Machine": f"{measuring.machine()}; {versions}; limit {limit_s:g} s; load average of the "
        f"last 15 minutes {os.getloadavg()[2]:.1f}.",
    }
    return "\n".join(f"## {title}\n\n{body}\n" for title, body in sections.items())


def _list(lines: Iterable[str]) -> str:
    return "\n".join(
        fill(f"- {line}", WIDTH, subsequent_indent="  ", break_on_hyphens=False) for line in lines
    )


def _reading(results: Results, limit_s: float) -> Iterator[str]:
    """What the tables say, in sentences made of them."""
    count = len(results.of(results.contenders[0]))
    for contender in results.contenders:
        solved = results.solved(contender)
        invalid, wrong = len(results.invalid(contender)), len(results.wrong_claims(contender))
        yield (
            f"**{contender}** solved {len(solved)} of {count} problems within {limit_s:g} s each; "
            f"{invalid} of its plans were invalid, and of {wrong} problems it said wrongly that "
            "they have no plan."
        )
    for other in results.contenders:
        if other in OURS:
            continue
        both = results.by_all(("native", other))
        mine, theirs = results.times("native", both), results.times(other, both)
        if both:
            yield (
                f"Where both native and {other} have a plan ({len(both)} problems), native's "
                f"median is {statistics.median(mine):.2f} s and {other}'s "
                f"{statistics.median(theirs):.2f} s."
            )
    ours = results.solved("native") | results.solved("portfolio")
    for other in results.contenders:
        if other not in OURS:
            lacking = sorted(results.solved(other) - ours)
            yield f"Solved by {other} and not by nondum: {', '.join(lacking) or 'none'}."


def _overall(results: Results, limit_s: float) -> str:
    within = [f"≤ {limit:g} s" for limit in WITHIN_S]
    head = [
        "",
        "solved",
        *within,
        "refused",
        "invalid",
        "wrong “no plan”",
        "s, median (range)",
        "cost ÷ cheapest",
    ]
    rows = []
    for contender in results.contenders:
        solved = results.solved(contender)
        rows.append(
            [
                contender,
                str(len(solved)),
                *(str(len(results.solved(contender, limit))) for limit in WITHIN_S),
                str(len(results.refused(contender))),
                str(len(results.invalid(contender))),
                str(len(results.wrong_claims(contender))),
                middle(results.times(contender, solved), ".2f"),
                middle(results.dearness(contender), ".2f"),
            ]
        )
    return table(head, rows)


def _phases(results: Results) -> str:
    rows = [
        [contender, *(middle(results.phase(contender, phase), ".3f") for phase in PHASES)]
        for contender in results.contenders
    ]
    return table(["s, median (range), where solved", *PHASES], rows)


def _by_group(results: Results) -> str:
    rows = []
    for group in results.groups:
        count = len(results.of(results.contenders[0], group))
        found = (results.of(contender, group) for contender in results.contenders)
        rows.append([f"{group} ({count})", *(str(sum(a.is_solved for a in of)) for of in found)])
    total = [str(len(results.solved(contender))) for contender in results.contenders]
    rows.append([f"all ({len(results.of(results.contenders[0]))})", *total])
    return table(["domain (problems)", *results.contenders], rows)


def _seconds(results: Results) -> str:
    rows = []
    for group in results.groups:
        row = [group]
        for contender in results.contenders:
            times = [a.took_s for a in results.of(contender, group) if a.is_solved]
            row.append(f"{statistics.median(times):.2f}" if times else "-")
        rows.append(row)
    return table(["domain", *results.contenders], rows)


def _wrong(results: Results) -> str:
    lines = []
    for contender in results.contenders:
        for what, problems in {
            "has an invalid plan": results.invalid(contender),
            "says wrongly that there is no plan": results.wrong_claims(contender),
            "refuses": results.refused(contender),
        }.items():
            if problems:
                lines.append(f"{contender} {what}: {', '.join(problems)}.")
    return _list(lines) or "None."
