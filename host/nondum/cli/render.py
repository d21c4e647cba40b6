"""Everything that is printed but tables and trees: JSON, times, sizes, sentences."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from typing import Any

import click

from nondum.host.core.printable import printable_text


def as_json(data: Any) -> None:
    """Print data for machines, readable for people."""
    click.echo(json.dumps(data, ensure_ascii=False, indent=2))


def as_json_line(data: Any) -> None:
    """Print data as one line, where more lines follow."""
    click.echo(json.dumps(data, ensure_ascii=False, separators=(",", ":")))


def sentence(text: str, *, colour: str | None = None, mark: str = "") -> None:
    """Print what may hold words of strangers: its lines stay lines, and nothing else."""
    click.secho(f"{mark}{lines_of(text)}", fg=colour)


def lines_of(text: str) -> str:
    """The text, safe for a terminal."""
    return printable_text(text)


def clock(wall_s: float) -> str:
    """A moment in local time, to the second."""
    return time.strftime("%F %T", time.localtime(wall_s))


def moment(wall_s: float) -> str:
    """The same, of today by the time of day alone."""
    day, time_of_day = clock(wall_s).split(" ")
    return time_of_day if day == time.strftime("%F") else f"{day} {time_of_day}"


def age(seconds: float | None) -> str:
    """How long something has been so, as people say it.

    >>> age(0.4), age(75), age(7300), age(200_000), age(None)
    ('0 s', '75 s', '2 h', '2 d', '')
    """
    if seconds is None:
        return ""
    for unit, length in (("d", 86_400), ("h", 3_600), ("min", 60)):
        if seconds >= 2 * length:
            return f"{seconds // length:.0f} {unit}"
    return f"{seconds // 1:.0f} s"


def size(count: int) -> str:
    """Bytes as people read them, in units of 1024, as all amounts of memory and disk are told.

    >>> size(0), size(921_600), size(188 << 20), size(12_000 << 20)
    ('0 B', '900.0 kB', '188.0 MB', '11.7 GB')
    """
    amount = float(count)
    for unit in ("B", "kB", "MB", "GB"):
        if amount < 1024.0 or unit == "GB":
            break
        amount /= 1024.0
    return f"{count} B" if unit == "B" else f"{amount:.1f} {unit}"


def goal(row: Mapping[str, Any]) -> dict[str, Any]:
    """A goal for a table: of why it is not reached the first line, and no remedies, which `why`
    tells; an answer is whole.

    >>> goal({"state": "suspended", "reason": "eye.see failed: DARK it is dark → light a lamp"})
    {'state': 'suspended', 'reason': 'eye.see failed: DARK it is dark'}
    """
    if row["state"] == "reached":
        return dict(row)
    return {**row, "reason": row["reason"].partition("\n")[0].partition(" → ")[0]}


def without_excerpt(problem: str) -> str:
    r"""A problem for a table's cell: without the source that it shows below its place.

    >>> without_excerpt("PDDL_INIT a.pddl:1:7: no fact\n    (:init (a))\n          ^\n→ correct it")
    'PDDL_INIT a.pddl:1:7: no fact → correct it'
    """
    return " ".join(line for line in problem.split("\n") if not line.startswith("    "))


def release(row: Mapping[str, Any]) -> str:
    """A release, and what became of the one before.

    >>> release({"release": 2, "was": 1}), release({"release": 1, "was": 2, "gone_back": True})
    ('2 (was 1)', '1 (gone back from 2)')
    >>> release({"release": 2, "was": None}), release({"release": None, "was": None})
    ('2', '')
    """
    if row["release"] is None:
        return ""
    if not row["was"]:
        return str(row["release"])
    how = "gone back from" if row["was"] > row["release"] else "was"
    return f"{row['release']} ({how} {row['was']})"


def progress(made: Mapping[str, Any] | None) -> str:
    """How far something is.

    >>> progress({"phase": "copy", "fraction": 0.25}), progress(None)
    ('copy 25 %', '')
    >>> progress({"phase": "queued", "total": 7, "fraction": 0.0})
    'queued behind 7'
    """
    if made and made["phase"] == "queued":
        return f"queued behind {made['total']}"
    return f"{made['phase']} {100 * made['fraction']:.0f} %" if made else ""


def machine(told: Mapping[str, Any]) -> list[str]:
    """How the machine is, a few words for each thing that it tells.

    >>> machine(
    ...     {
    ...         "batteries": [{"name": "BAT0", "percent": 81, "state": "discharging"}],
    ...         "disk": {"free_mb": 12_000},
    ...         "temperatures": [{"celsius": 41.0}, {"celsius": 47.5}],
    ...         "load": {"one_min": 0.42},
    ...     }
    ... )
    ['battery 81 % (discharging)', 'disk 11.7 GB free', '48 °C', 'load 0.42']
    """
    words = [f"battery {_fullness(battery)}" for battery in told["batteries"]]
    if told["disk"]:
        words.append(f"disk {size(told['disk']['free_mb'] << 20)} free")
    if told["temperatures"]:
        words.append(f"{max(zone['celsius'] for zone in told['temperatures']):.0f} °C")
    if told["load"]:
        words.append(f"load {told['load']['one_min']:.2f}")
    return words


def _fullness(battery: Mapping[str, Any]) -> str:
    percent, state = battery["percent"], battery["state"]
    return state if percent is None else f"{percent} % ({state})"
