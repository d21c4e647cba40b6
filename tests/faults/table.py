"""The page of figures that a campaign of faults comes to."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

from tests.faults.points import Result
from tests.faults.ways import COMPONENT_WAYS

from nondum.host.core.transitions import TRANSITIONS

WHAT = {
    "boundary": "SIGKILL before or after the commit of a row of the transition tables",
    "kill": "SIGKILL of the process that makes the nth call of a kind (strace)",
    "moment": "SIGKILL at a random moment of an installation, an upgrade and two removals",
    "error": "the nth call of a kind fails (strace: ENOSPC, EIO, EMFILE, ENOMEM, EROFS, EAGAIN)",
    "power": "the power is cut after a write of the disk; a part of what was not flushed is lost",
}


def page(results: Sequence[Result], full: Mapping[str, int], machine: str) -> str:
    """The page, in Markdown."""
    return "\n".join(_lines(results, full, machine)) + "\n"


def _lines(results: Sequence[Result], full: Mapping[str, int], machine: str) -> Iterator[str]:
    yield "# Faults: what was tried, and what it came to"
    yield ""
    yield "Written by `python -m tests.faults --table docs/reliability/faults.md`; see"
    yield f"[reliability](../reliability.md) for what is checked after each. Machine: {machine}."
    yield ""
    yield "Points are drawn by lot: `sampled: N of M` are N of the M that one draw has. What was"
    yield "not drawn, or not run yet, was not tried."
    yield ""
    yield "| fault | points | daemon killed | lived on | wrong | restart, median (p95, max) |"
    yield "|---|---|---|---|---|---|"
    for kind, what in WHAT.items():
        found = [result for result in results if result.kind == kind]
        outcomes = Counter(result.outcome for result in found)
        wrong = sum(bool(result.wrong) for result in found)
        whole = _whole(kind, full)
        killed = len(found) if kind == "power" else outcomes["killed"]
        lived = outcomes["lived"]
        spread = _spread([result.restart_s for result in found if result.restart_s])
        done = f"all {whole}" if len(found) == whole else f"sampled: {len(found)} of {whole}"
        yield f"| {what} | {done} | {killed} | {lived} | {wrong} | {spread} |"
    yield ""
    yield "Restart is the time from opening the catalogue until the daemon has recovered and"
    yield "follows events, with one payload or two; the interpreter's own start comes on top."
    yield ""
    yield from _codes(results)
    yield from _wrong(results)


def _whole(kind: str, full: Mapping[str, int]) -> int:
    if kind == "boundary":
        return full[kind] * 2 * (len(TRANSITIONS) + len(COMPONENT_WAYS))
    return full[kind]


def _spread(times: Iterable[float]) -> str:
    ordered = sorted(times)
    if not ordered:
        return "-"
    p95 = ordered[min(len(ordered) - 1, int(len(ordered) * 0.95))]
    return f"{statistics.median(ordered):.2f} s ({p95:.2f}, {ordered[-1]:.2f})"


def _codes(results: Sequence[Result]) -> Iterator[str]:
    errors = [result for result in results if result.kind == "error"]
    if not errors:
        return
    counts = Counter(code for result in errors for code in result.codes)
    silent = sum(not result.codes for result in errors)
    yield "## What was told of errors"
    yield ""
    yield f"Of {len(errors)} failed calls {silent} were made good without a word; the others:"
    yield ""
    yield "| code | points |"
    yield "|---|---|"
    for code, count in counts.most_common():
        yield f"| `{code}` | {count} |"
    yield ""


def _wrong(results: Sequence[Result]) -> Iterator[str]:
    wrong = [result for result in results if result.wrong]
    if wrong:
        yield "## What was wrong"
        yield ""
        yield "| fault | point | what |"
        yield "|---|---|---|"
        for result in wrong:
            what = "; ".join(result.wrong).replace("\n", " ").replace("|", "/")[:300]
            yield f"| {result.kind} | {result.name} | {what} |"
