"""What can be asked for now, in whose words, and whether it can be had: plain data for tools.

A function of the composition and of what is believed; it takes its time, so call it in a thread.
"""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Iterator
from typing import Any, TypeAlias

from nondum.host.mind.composition import Composition
from nondum.host.mind.diagnosis import Seen, WhyNot, why_not
from nondum.host.mind.lack import Need
from nondum.host.mind.missing_reports import Silence
from nondum.planning.explain.cause import Lack
from nondum.planning.ground.delete_relaxation import quick_answer
from nondum.planning.ground.exploration import explore
from nondum.planning.ground.ground import ground
from nondum.planning.merge.domain import bind
from nondum.planning.merge.goal import Goal, goal_text
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import type_text
from nondum.planning.words.pattern import Slot
from nondum.planning.words.phrases import Reading
from nondum.sdk.errors import FragmentRefused
from nondum.sdk.planner import AlreadyTrue, Unsolvable

Row: TypeAlias = dict[str, Any]

MOST_EXPLAINED = 50
"""Goals that cannot be had and are explained, at most; of the rest it is only said."""
_NOTHING = WhyNot(())


def phrases(composition: Composition) -> list[Row]:
    """Each phrase: `phrase`, `goal` with variables, `kind`, `from` (components), `slots`: `slot`,
    `types`, `values` (`words`, `object`, `from`)."""
    rows: dict[tuple[str, str], Row] = {}
    for phrase in composition.book.phrases:
        row: Row = {
            "phrase": phrase.pattern,
            "goal": goal_text(phrase.condition),
            "kind": phrase.kind,
            "from": [],
            "slots": [_slot(slot, composition) for slot in phrase.binding_slots()],
        }
        kept = rows.setdefault((phrase.pattern, row["goal"]), row)
        kept["from"].append(phrase.component)
    return [row for _, row in sorted(rows.items())]


def offers(composition: Composition, outlook: Outlook) -> list[Row]:
    """Each sentence: `words`, `goal`, `kind`, `now`, `lacks`, `needs`, `from` (components).

    `now` is `holds`, `can` (nothing is missing, deletes ignored), `cannot` (then `lacks` says what,
    and who used to supply it, and `needs` has what is missing as data, see `Need`), `ambiguous` (it
    means something else too), or `unknown` where there are too many ways to look at. Phrases with
    nothing to name are there as their authors wrote them.
    """
    readings: dict[tuple[object, ...], list[Reading]] = {}
    for reading in composition.book.offered():
        readings.setdefault((reading.goal.text, *reading.meaning), []).append(reading)
    said = Counter(same[0].goal.text for same in readings.values())
    rows = [
        offer(same, outlook, composition, is_clear=said[same[0].goal.text] == 1)
        for same in readings.values()
    ]
    return sorted([*rows, *_mute(composition)], key=lambda row: (row["words"], row["goal"]))


def prospect(
    composition: Composition, facts: frozenset[str], bare_facts: frozenset[str], goal: Goal
) -> str:
    """`now` of one goal: `holds`, `can`, `cannot` or `unknown`, see `offers`."""
    return Outlook(composition, facts, bare_facts, ()).of(goal)[0]


def offer(
    same: list[Reading], outlook: Outlook, composition: Composition, *, is_clear: bool = True
) -> Row:
    """The row of a goal, which several phrases may ask for; `is_clear`: its words mean no other."""
    goal = same[0].goal
    now, why = outlook.of(goal) if is_clear else ("ambiguous", _NOTHING)
    return {
        "words": goal.text,
        "goal": goal_text(goal.expr),
        "kind": goal.kind,
        "now": now,
        **_why(why),
        "from": sorted({name for reading in same for name in _bringers(reading, composition)}),
    }


def _why(why: WhyNot) -> Row:
    return {
        "lacks": [problem.message for problem in why.problems],
        "needs": [need.to_dict() for need in why.needs],
    }


def _bringers(reading: Reading, composition: Composition) -> Iterator[str]:
    """The components that bring the phrase, and the names in it."""
    yield reading.phrase.component
    for thing in reading.bound.values():
        if namer := composition.book.namers.get(thing):
            yield namer


def _mute(composition: Composition) -> Iterator[Row]:
    """Phrases that cannot be said: there is nothing to name in one of their slots."""
    for phrase in composition.book.phrases:
        slots = phrase.binding_slots()
        needs = [_to_name(slot) for slot in slots if not composition.book.things_for(slot)]
        if needs:
            yield {
                "words": phrase.pattern,
                "goal": goal_text(phrase.condition),
                "kind": phrase.kind,
                "now": "cannot",
                "lacks": [need.said for need in needs],
                "needs": [need.to_dict() for need in needs],
                "from": [phrase.component],
            }


def _to_name(slot: Slot) -> Need:
    said = f"there is no {type_text(slot.types)} to name"
    return Need(Lack.OBJECT.value, said, types=slot.types)


def _slot(slot: Slot, composition: Composition) -> Row:
    book = composition.book
    values = [
        {"words": book.labels[thing], "object": thing, "from": book.namers.get(thing, "")}
        for thing in book.things_for(slot)
    ]
    return {"slot": slot.name, "types": list(slot.types), "values": values}


class Outlook:
    """Whether goals can be had. One exploration serves all that ask for facts only."""

    def __init__(
        self,
        composition: Composition,
        facts: frozenset[str],
        bare_facts: frozenset[str],
        seen: tuple[Seen, ...],
    ) -> None:
        self._composition, self._seen = composition, seen
        self._facts, self._bare = facts, bare_facts
        self._explained = 0
        self._reachable: frozenset[str] | None = None
        with contextlib.suppress(FragmentRefused):  # too many ways
            self._reachable = explore(composition.merged, bare_facts).reachable

    def of(self, goal: Goal) -> tuple[str, WhyNot]:
        """`now` of a goal, and why it cannot be had if it cannot."""
        if self._reachable is None:
            return "unknown", _NOTHING
        try:
            return self._looked_at(goal, self._reachable)
        except FragmentRefused:  # it speaks of too much
            return "unknown", _NOTHING

    def _looked_at(self, goal: Goal, reachable: frozenset[str]) -> tuple[str, WhyNot]:
        expr = goal.expr
        wanted = {bind(atom, {}) for atom in expr.positive}
        if expr == Condition(positive=expr.positive):
            holds, can = wanted <= self._facts, wanted <= reachable
        else:
            holds = isinstance(self._quick_answer(goal, self._facts), AlreadyTrue)
            can = not isinstance(self._quick_answer(goal, self._bare), Unsolvable)
        if holds:
            return "holds", _NOTHING
        return ("can", _NOTHING) if can else ("cannot", self._why_not(goal))

    def _quick_answer(self, goal: Goal, facts: frozenset[str]) -> object:
        return quick_answer(ground(self._composition.merged, facts, goal.expr))

    def _why_not(self, goal: Goal) -> WhyNot:
        self._explained += 1
        if self._explained > MOST_EXPLAINED:
            return _NOTHING
        merged, silence = self._composition.merged, Silence.of(self._composition.snapshot)
        return why_not(merged, goal, self._bare, self._seen, silence=silence)
