"""How well sentences were understood: by the goals, never by the words."""

from __future__ import annotations

from collections.abc import Iterable

from benchmarks.language.corpus import Sentence
from benchmarks.language.understanding import Rung

from nondum.sdk.frozen import frozen


@frozen
class Score:
    """Of some sentences."""

    right: int = 0
    """What was meant was understood, or what cannot be a goal was not taken for one."""
    missed: int = 0
    """A goal was meant, and none was understood: the person is asked."""
    wrong: int = 0
    """Another goal was understood, or one where none was meant: what must never be."""

    @property
    def total(self) -> int:
        """Sentences."""
        return self.right + self.missed + self.wrong

    def __add__(self, other: Score) -> Score:
        return Score(self.right + other.right, self.missed + other.missed, self.wrong + other.wrong)


RIGHT, MISSED, WRONG = Score(right=1), Score(missed=1), Score(wrong=1)


def judged(meant: str, understood: str) -> Score:
    """One answer.

    >>> judged("S|K", "K").right, judged("-F", "F").wrong, judged("F+W", "W+F").right
    (1, 1, 1)
    >>> judged("F?", "").right, judged("F", "").missed, judged("none", "P").wrong
    (1, 1, 1)
    """
    if meant in ("none", "halt") or meant.startswith("-") or meant.endswith("?"):
        return WRONG if understood else RIGHT
    if not understood:
        return MISSED
    return RIGHT if understood in _accepted(meant) else WRONG


def _accepted(meant: str) -> frozenset[str]:
    if "+" in meant:
        one, other = meant.split("+")
        return frozenset({meant, f"{other}+{one}"})
    return frozenset(meant.split("|"))


def scored(rung: Rung, sentences: Iterable[Sentence]) -> Score:
    """All answers of a rung."""
    return sum((judged(s.meaning, rung.meaning(s.text)) for s in sentences), Score())
