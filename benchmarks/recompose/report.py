"""The tables of a run, in Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from benchmarks.recompose.insertion import PHASES
from benchmarks.recompose.results import AIMS, FIRST, KNOWN, LOAD, START, WAYS, Findings, Results
from benchmarks.recompose.spreads import Spread, ratios, spread


def as_markdown(results: Results) -> str:
    """The whole report but for the title and the method."""
    sections = [
        ("Machine", _list(results.machine)),
        ("Insertion until ready", _times(results)),
        ("Where nondum's time goes", _phases(results)),
        ("Bytes on the drive", _bytes(results)),
        ("Memory at rest", _memory(results)),
    ]
    return "\n".join(f"## {title}\n\n{body}\n" for title, body in sections)


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, words: int = 2) -> str:
    """A Markdown table; the first `words` columns hold words, the others figures.

    >>> print(table(["what", "ms"], [["a", "1"], ["bc", "20"]], words=1))
    | what | ms |
    |------|---:|
    | a    |  1 |
    | bc   | 20 |
    """
    widths = [max(len(line[i]) for line in [head, *rows]) for i in range(len(head))]
    rule = ["-" * (width + 2) for width in widths]
    rule[words:] = [f"{dashes[1:]}:" for dashes in rule[words:]]
    lines = (_line(row, widths, words) for row in rows)
    return "\n".join([_line(head, widths, words), f"|{'|'.join(rule)}|", *lines])


def _line(cells: Sequence[str], widths: Sequence[int], words: int) -> str:
    padded = [
        cell.ljust(width) if number < words else cell.rjust(width)
        for number, (cell, width) in enumerate(zip(cells, widths, strict=True))
    ]
    return f"| {' | '.join(padded)} |"


def _list(lines: Sequence[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)


def _times(results: Results) -> str:
    head = ["payload", "way", "ms", f"÷ {LOAD}", f"÷ {START}", "aim", "met"]
    rows = [row for findings in results.payloads for row in _time_rows(findings)]
    note = f"\n\nNo container was measured: {results.missing}" if results.missing else ""
    return table(head, rows) + note


def _time_rows(findings: Findings) -> Iterator[list[str]]:
    for way in WAYS:
        if not (ready_s := findings.ready_s(way)):
            continue
        to_load = _ratio(ready_s, findings.ready_s(LOAD))
        to_start = _ratio(ready_s, findings.ready_s(START))
        aim, met = _judged(findings.name, way, to_load, to_start)
        ratio_cells = [_spread(to_load, 1, 2), _spread(to_start, 1, 2)]
        yield [findings.name, way, _spread(spread(ready_s), 1000, 0), *ratio_cells, aim, met]


def _ratio(values: Sequence[float], against: Sequence[float]) -> Spread | None:
    return ratios(values, against) if against else None


def _judged(
    payload: str, way: str, to_load: Spread | None, to_start: Spread | None
) -> tuple[str, str]:
    """The aim for a row, and whether the medians meet it."""
    bound = AIMS.get(payload, {}).get(way)
    if bound is None:
        return "", ""
    aims = [(f"≤ {bound:g}", to_load, bound)]
    if way == KNOWN:
        aims.append(("≤ 1", to_start, 1.0))
    text = ", ".join(words for words, _, _ in aims)
    if to_load is None or to_start is None:
        return text, "?"
    return text, "yes" if all(s and s.median <= most for _, s, most in aims) else "NO"


def _spread(found: Spread | None, scale: float, digits: int) -> str:
    """`median (low-high)`."""
    if found is None:
        return "-"
    median, low, high = (f"{v * scale:.{digits}f}" for v in (found.median, found.low, found.high))
    return f"{median} ({low}-{high})"


def _phases(results: Results) -> str:
    head = ["payload", "way", *PHASES, "shown", "in a plan"]
    rows = []
    for findings in results.payloads:
        for way in (FIRST, KNOWN):
            insertions = findings.insertions[way]
            columns = [[i.phases_s[phase] for i in insertions] for phase in PHASES]
            columns += [[i.ready_s for i in insertions], [i.planned_s for i in insertions]]
            rows.append([findings.name, way, *(f"{spread(c).median * 1000:.0f}" for c in columns)])
    return table(head, rows) + "\n\nMedians, in ms after the insertion."


def _bytes(results: Results) -> str:
    rows = [
        [findings.name, what, f"{size / 1e6:.1f}", f"{size / findings.bytes['payload']:.1f}"]
        for findings in results.payloads
        for what, size in findings.bytes.items()
    ]
    return table(["payload", "what is carried", "MB", "÷ payload"], rows)


def _memory(results: Results) -> str:
    rows = []
    for findings in results.payloads:
        columns = {
            "worker": [m.worker for m in findings.memory],
            "container": [c.process for c in findings.containers],
            "conmon": [c.conmon for c in findings.containers],
            "daemon": [m.daemon for m in findings.memory],
            "daemon's spare processes": [m.spares for m in findings.memory],
        }
        for what, values in columns.items():
            if values:
                rows.append([findings.name, what, f"{spread(values).median:.1f}"])
    return table(["payload", "what", "PSS, MB"], rows)
