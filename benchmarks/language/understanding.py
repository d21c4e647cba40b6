"""Who is asked what a sentence means: the robot's rungs, and what they are compared with."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from benchmarks.language import corpus

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.goal import Goal, parse_goal
from nondum.planning.merge.merge import merge
from nondum.planning.pddl.normal import Condition
from nondum.planning.words.near import nearest
from nondum.planning.words.pattern import words_of
from nondum.planning.words.phrases import Phrasebook, phrasebook
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import GoalRefused
from nondum.sdk.frozen import frozen
from nondum.sdk.plugin import describe, load

HOST = "rover"
PLUGINS = Path(__file__).parents[2] / "plugins"
SHIPPED = (
    *("compton-camera", "depth-estimator", "gps", "mobile-base", "pan-tilt-unit"),
    *("people-detector", "pedestrian-detector", "speaker", "thermal-camera", "visual-tracker"),
)
NEAR = 0.5
"""Share of words in common from which on the baseline takes one sentence for another."""


class Rung(Protocol):
    """Something that understands sentences."""

    name: str

    def meaning(self, sentence: str) -> str:
        """The letters of the goals that it takes a sentence for, as in the corpus; "": none."""
        ...


@frozen
class Robot:
    """What can be said to a robot with the shipped payloads, and its goals by their letters."""

    book: Phrasebook
    letters: Mapping[tuple[Condition, str], str]

    def letter(self, goal: Goal) -> str:
        """The letter of a goal; "?" for one that is not listed."""
        return self.letters.get((goal.expr, goal.kind), "?")


def robot() -> Robot:
    """A robot with the shipped payloads."""
    sys.path += [str(PLUGINS / name) for name in (*SHIPPED, "espeak")]
    contributions = [
        Contribution.from_description(_described(name), host=HOST, component=name)
        for name in SHIPPED
    ]
    merged = merge(contributions, HOST)
    letters = {
        (parse_goal(goal.pddl, merged).expr, goal.kind): letter
        for letter, goal in corpus.goals().items()
    }
    return Robot(phrasebook(contributions, merged), letters)


def _described(name: str) -> PluginDescription:
    text = (PLUGINS / name / "pyproject.toml").read_text(encoding="utf-8")
    (target,) = tomllib.loads(text)["project"]["entry-points"]["nondum.plugins"].values()
    return describe(load(target, name))


class Declared:
    """Declared phrases, matched exactly: what the robot has."""

    name = "declared phrases"

    def __init__(self, to: Robot) -> None:
        self._robot = to

    def meaning(self, sentence: str) -> str:
        """The goal of the phrase that fits."""
        try:
            return self._robot.letter(self._robot.book.goal(sentence))
        except GoalRefused:
            return ""


class Nearly:
    """Declared phrases, and what is nearly one: asked back."""

    name = "nearly declared"

    def __init__(self, to: Robot) -> None:
        self._robot = to

    def meaning(self, sentence: str) -> str:
        """The goal of the phrase that it is, or of the only one that is near."""
        if said := Declared(self._robot).meaning(sentence):
            return said
        near = nearest(self._robot.book, sentence)
        return self._robot.letter(near[0].reading.goal) if len(near) == 1 else ""


class WordOverlap:
    """The baseline: the declared sentence that has most words in common."""

    name = "word overlap"

    def __init__(self, to: Robot) -> None:
        self._offers = [
            (frozenset(words_of(reading.goal.text)), to.letter(reading.goal))
            for reading in to.book.offered()
        ]

    def meaning(self, sentence: str) -> str:
        """The goal of the nearest, by words in common among all, if that is near."""
        said = frozenset(words_of(sentence))
        nearest = max(
            (len(said & words) / len(said | words), letter) for words, letter in self._offers
        )
        return nearest[1] if nearest[0] >= NEAR else ""
