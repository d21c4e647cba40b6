"""The page that a run writes, in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from benchmarks import measuring
from benchmarks.stop.results import Hearing, Results, Spoken, Way

AIM_S, SPOKEN_AIM_S = 0.1, 1.0
MOST_MISTAKES = 10


def as_markdown(results: Results) -> str:
    """All but the title and the method."""
    calm = f"{sum(results.calm)} of {len(results.calm)} parts began on a calm machine"
    sections = {
        "Typed, and by a button": _acting(results.ways),
        "Spoken": _spoken(results.hearings),
        "What was mistaken most": _mistakes(results.hearings),
        "Machine": "; ".join(
            (*results.notes, measuring.machine(), f"{results.rounds} rounds", calm)
        )
        + ".",
    }
    return "\n".join(f"## {title}\n\n{body}\n" for title, body in sections.items() if body)


def _acting(ways: Sequence[Way]) -> str:
    head = ["", "stopped by", "n", "missed", "asked to halt: median", "p95", "max"]
    head += [f"≤ {1000 * AIM_S:.0f} ms", "all had ended: median", "max"]
    rows = []
    for way in ways:
        asked = [stop.asked_s for stop in way.stops]
        ended = [stop.ended_s for stop in way.stops]
        share = _share(sum(one <= AIM_S for one in asked), len(asked))
        spread = [*_spread(asked), share, *_spread(ended)[::2]]
        rows.append([way.where, way.how, str(len(way.stops)), str(way.missed), *spread])
    return measuring.table(head, rows) if rows else ""


def _spoken(hearings: Sequence[Hearing]) -> str:
    head = ["", "understood", "missed", "taken for something else"]
    head += ["after the word's end: median", "p95", "max", "of that, sound: median"]
    head += [f"≤ {SPOKEN_AIM_S:g} s", "false stops"]
    rows = []
    for hearing in hearings:
        stops, understood = len(hearing.stops), len(hearing.understood)
        mistaken = len(hearing.mistaken)
        after = [one.after_s for one in hearing.understood if one.after_s is not None]
        sound = [one.sound_s for one in hearing.understood if one.sound_s is not None]
        rows.append(
            [
                hearing.circumstance,
                _share(understood, stops),
                _share(stops - understood - mistaken, stops),
                _share(mistaken, stops),
                *_spread(after),
                _spread(sound)[0],
                _share(sum(one <= SPOKEN_AIM_S for one in after), len(after)),
                _share(len(hearing.false), len(hearing.others)),
            ]
        )
    return measuring.table(head, rows) if rows else ""


def _mistakes(hearings: Sequence[Hearing]) -> str:
    wrong: Iterable[Spoken] = (
        one for hearing in hearings for one in (*hearing.mistaken, *hearing.false)
    )
    counted = Counter((one.text, one.heard or "") for one in wrong)
    rows = [[said, heard, str(n)] for (said, heard), n in counted.most_common(MOST_MISTAKES)]
    return measuring.table(["said", "taken for", "times"], rows) if rows else ""


def _spread(seconds: Sequence[float]) -> list[str]:
    """Median, 95th percentile and maximum.

    >>> _spread([0.01, 0.02, 2.5]), _spread([])
    (['20 ms', '2500 ms', '2500 ms'], ['–', '–', '–'])
    """
    if not seconds:
        return ["–"] * 3
    found = (*(measuring.percentile(seconds, percent) for percent in (50, 95)), max(seconds))
    return [f"{1000 * one:.0f} ms" for one in found]


def _share(part: int, whole: int) -> str:
    """How many, of how many.

    >>> _share(1, 8), _share(0, 0)
    ('12.5 % of 8', '–')
    """
    return f"{100 * part / whole:.1f} % of {whole}" if whole else "–"
