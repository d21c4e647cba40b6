"""What `nondum watch` shows: a host at a glance, in as many lines as there are. Pure."""

from __future__ import annotations

import textwrap
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import click

from nondum.cli import render
from nondum.cli.outline import STEP_COLOUR, STEP_MARK
from nondum.host.core.printable import printable
from nondum.sdk.frozen import frozen

View = Mapping[str, Any]

LEAST_WIDTH = 20
QUIET_S = 10.0
"""A host that has told nothing for so long hangs, or its machine does: it tells every few
seconds."""
_GOALS = {
    "active": ("▶", "green"),
    "queued": ("·", "yellow"),
    "suspended": ("✗", "red"),
    "reached": ("✓", "green"),
    "halted": ("■", None),
}
_OPEN = ("active", "queued", "suspended")


@frozen
class Line:
    """One line: a mark, and words of which what does not fit is cut."""

    text: str
    mark: str = " "
    colour: str | None = None

    def shown(self, width: int | None) -> str:
        """It, as a terminal shows it."""
        return f" {click.style(self.mark, fg=self.colour)} {cut(self.text, width and width - 3)}"


@frozen
class Section:
    """Lines under a title."""

    title: str
    lines: tuple[Line, ...]
    newest_last: bool = False
    """Whether the last lines are kept, not the first, where not all of them fit."""

    def shown(self, count: int, width: int | None) -> Iterator[str]:
        """The title, and `count` lines."""
        some = f" ({count} of {len(self.lines)})" if count < len(self.lines) else ""
        yield click.style(cut(f"{self.title}{some}", width), bold=True)
        kept = self.lines[-count:] if self.newest_last else self.lines[:count]
        yield from (line.shown(width) for line in kept if count)


def screen(
    view: View, *, width: int | None, height: int | None, wall_s: float, quiet_s: float = 0.0
) -> list[str]:
    """The lines of a view (of the verb `watch`); None: nothing is cut. `wall_s` is now, `quiet_s`
    the time since the view came."""
    width = width and max(LEAST_WIDTH, width)
    head = [_header(view, width, wall_s, quiet_s)]
    if told := render.machine(view["machine"]):
        head.append(cut(", ".join(told), width))
    sections = [section for section in _sections(view, width) if section.lines]
    if height is None:
        counts = [len(section.lines) for section in sections]
    else:
        counts = shared(max(0, height - len(head)), [len(s.lines) for s in sections])
    spare = None if height is None else height - len(head) - sum(n + 1 for n in counts if n)
    is_airy = spare is None or spare >= len(sections)
    lines = head
    for section, count in zip(sections, counts, strict=True):
        if count:
            lines += [*([""] if is_airy else []), *section.shown(count, width)]
    return lines


def waiting(name: str, *, width: int | None, wall_s: float, since_s: float) -> list[str]:
    """What is shown while no host answers: nothing that is not so any more."""
    gone = time.strftime("%T", time.localtime(since_s))
    return [
        _edges(f"nondum {name}", f"q ends it  {_clock(wall_s)}", width),
        cut(f"waiting for the host … (it has not answered since {gone})", width),
    ]


def shared(space: int, wanted: Sequence[int]) -> list[int]:
    """How many lines each section gets, beside its title: in turn, so that a long one does not take
    the place of those after it.

    >>> shared(20, [2, 3, 4]), shared(9, [2, 9, 9]), shared(4, [1, 1, 1])
    ([2, 3, 4], [2, 2, 2], [1, 1, 0])
    """
    counts = [0] * len(wanted)
    while True:
        before = list(counts)
        for i, most in enumerate(wanted):
            cost = 1 if counts[i] else 2  # the first line comes with a title
            if counts[i] < most and space >= cost:
                counts[i] += 1
                space -= cost
        if counts == before:
            return counts


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of words as lines, each column as wide as it needs to be.

    >>> aligned([("eye.image", "10/s", "→ tracker"), ("base.odometry", "-", "")])
    ['eye.image      10/s  → tracker', 'base.odometry  -']
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = (
        "  ".join(word.ljust(w) for word, w in zip(row, widths, strict=True) if w) for row in rows
    )
    return [line.rstrip() for line in padded]


def cut(text: str, width: int | None) -> str:
    """Words of strangers in one line, as far as they fit.

    >>> cut("a long story", 8), cut("short", 8), cut("a long story", None)
    ('a long …', 'short', 'a long story')
    """
    text = printable(" ".join(text.splitlines()))
    return text if width is None or len(text) <= width else f"{text[: max(0, width - 1)]}…"


def _header(view: View, width: int | None, wall_s: float, quiet_s: float) -> str:
    state = view["state"]
    if quiet_s >= QUIET_S:
        state = f"silent for {render.age(quiet_s)}"
    elif view["feedback"]["state"] == "needs-help":
        state = f"{state}, needs help"
    right = f"q ends it  {_clock(wall_s)}" if width else _clock(wall_s)
    return _edges(f"nondum {view['host']}: {state}", right, width)


def _edges(left: str, right: str, width: int | None) -> str:
    left, right = printable(left), printable(right)
    if width is None:
        return f"{click.style(left, bold=True)}  {right}"
    left = cut(left, width - len(right) - 2)
    return f"{click.style(left, bold=True)}{' ' * (width - len(left) - len(right))}{right}"


def _sections(view: View, width: int | None) -> Iterator[Section]:
    yield Section("TROUBLE", tuple(_trouble(view)))
    yield Section("GOALS", tuple(_goals(view["goals"])))
    yield Section("PLAN", tuple(_plan(view["tree"])))
    yield Section("PARTS", tuple(_parts(view, width)))
    yield Section("STREAMS", tuple(_streams(view["streams"])))
    yield Section("TOLD", tuple(_told(view["told"])), newest_last=True)


def _trouble(view: View) -> Iterator[Line]:
    of_payloads = (
        f"{row['payload']}: {problem}"
        for row in view["payloads"]
        if not row["place"]
        for problem in row["problems"]
    )
    of_drives = (f"drive {d['drive']}: {text}" for d in view["drives"] for text in d["problems"])
    for text in dict.fromkeys([*of_payloads, *of_drives]):
        yield Line(text, "!", "red")
    for text in (*view["machine"]["warnings"], *view["warnings"]):
        yield Line(text, "!", "yellow")


def _goals(given: Sequence[View]) -> Iterator[Line]:
    wanted = [goal for goal in given if goal["state"] in _OPEN]
    for goal in sorted(wanted, key=lambda goal: _OPEN.index(goal["state"])) or given[-1:]:
        mark, colour = _GOALS[goal["state"]]
        mark = "∞" if goal["holds"] and goal["state"] == "active" else mark
        words = f"{goal['id']} {goal['text']}"
        yield Line(
            "  ".join(filter(None, (words, goal["state"], render.goal(goal)["reason"]))),
            mark,
            colour,
        )
    if not given:
        yield Line("nothing was asked for")


def _plan(tree: View) -> Iterator[Line]:
    """The steps of the plan, in the short form of the tree."""
    steps = list(_steps(tree))
    for step, text in zip(steps, aligned(list(map(_step, steps))), strict=True):
        yield Line(text, STEP_MARK.get(step["state"], "·"), STEP_COLOUR.get(step["state"]))


def _step(step: View) -> tuple[str, ...]:
    started = f"since {_clock(step['started'])}" if step["started"] and not step["ended"] else ""
    after = sorted({row["step"] for row in step["waits_for"] if row["step"] is not None})
    waits = f"after {', '.join(map(str, after))}" if after else ""
    name = f"{step['number']} {step['schema']}"
    return name, step["state"], started or waits, step["progress"]


def _steps(node: View) -> Iterator[View]:
    if step := node.get("step"):
        yield step
    for child in node.get("children", ()):
        yield from _steps(child)


def _parts(view: View, width: int | None) -> Iterator[Line]:
    """What comes and what is not well, a line each; then what is ready, in one list."""
    for payload in view["payloads"]:
        if made := render.progress(payload["progress"]):
            yield Line(f"{payload['payload']}  {made}", "…", "yellow")
    rows = view["components"]
    for row in rows:
        if not row["ready"] or row["state"] != "ready":
            told = (_part(row, view["host"]), row["state"], row["problem"])
            yield Line("  ".join(filter(None, told)), "✗", "red")
    well = [_part(r, view["host"]) for r in rows if r["ready"] and r["state"] == "ready"]
    space = 10_000 if width is None else width - 3
    for i, line in enumerate(textwrap.wrap(", ".join(well), space, break_on_hyphens=False)):
        yield Line(line, *((" ", None) if i else ("✓", "green")))
    if not rows and not view["payloads"]:
        yield Line("nothing is plugged in")


def _part(row: View, host: str) -> str:
    where = "" if row["host"] == host else f"@{row['host']}"
    return f"{row['component']}{where} {row['version']}"


def _streams(streams: Sequence[View]) -> Iterator[Line]:
    rows = sorted(streams, key=lambda row: not row["flowing"])
    for row, text in zip(rows, aligned(list(map(_stream, rows))), strict=True):
        yield Line(text, *(("~", "green") if row["flowing"] else ("·", None)))


def _stream(row: View) -> tuple[str, ...]:
    output = row["stream"].rpartition("__")[2]
    readers = ", ".join(dict.fromkeys(name.split(".")[0] for name in row["consumers"]))
    rate = f"{row['rate_hz']:.3g}/s" if row["rate_hz"] else "flows" if row["flowing"] else "-"
    return f"{row['component']}.{output}", rate, readers and f"→ {readers}"


def _told(told: Sequence[View]) -> Iterator[Line]:
    return (Line(f"{_clock(row['when'])}  {row['text']}", ">") for row in told)


def _clock(wall_s: float) -> str:
    return time.strftime("%T", time.localtime(wall_s))
