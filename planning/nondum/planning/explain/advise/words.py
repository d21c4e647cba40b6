"""What a person's words ask for, when they may be the words of a payload that is not here."""

from __future__ import annotations

from collections.abc import Sequence

from nondum.planning.explain.advise.candidate import Candidate, Here
from nondum.planning.merge.goal import Goal
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import phrasebook
from nondum.sdk.errors import GoalRefused


def understood(sentence: str, here: Here, candidates: Sequence[Candidate]) -> Goal:
    """The goal that a sentence asks for: as it is understood here, else as it would be if all
    candidates were here. Raises `GoalRefused` as `Phrasebook.goal` does."""
    try:
        return _said(sentence, here)
    except GoalRefused as refused:
        try:
            return _said(sentence, here.beside(candidates))
        except GoalRefused as also:
            raise (refused if also.code == "PHRASE_UNKNOWN" else also) from None


def _said(sentence: str, here: Here) -> Goal:
    merged = merge(here.contributions, here.host)
    return phrasebook(here.contributions, merged).goal(sentence)
