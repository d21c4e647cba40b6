"""Words that match no phrase: nearly one, or translated by components, whose answers are checked.

Nothing is guessed: answers that mean nothing here are refused by name, and different ones are told
instead of chosen from.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any, TypeAlias, cast, get_args

from nondum.host.mind.component_plugins import Answers
from nondum.host.mind.composition import Composition
from nondum.planning.merge.domain import Predicate
from nondum.planning.merge.goal import GoalKind, goal_text, parse_goal
from nondum.planning.pddl.syntax import type_text
from nondum.planning.words.near import Near, nearest
from nondum.planning.words.pattern import Slot, with_slots
from nondum.planning.words.phrases import Phrasebook
from nondum.sdk.errors import GoalRefused, NondumError, Problem
from nondum.sdk.frozen import frozen

UNMATCHED = frozenset({"PHRASE_UNKNOWN", "PHRASE_WORDS_UNKNOWN"})
"""Refusals of words that a translator may still understand; it is not asked of ambiguous ones."""
LONGEST_WORDS = 1000
"""Characters of a sentence that is translated."""
VOCABULARY_BYTES = 40_000
"""The size of a vocabulary that fits a packet to a worker, with some margin."""
_ENTRIES = 400

Vocabulary: TypeAlias = dict[str, Any]
Asked: TypeAlias = Callable[[Vocabulary], Answers]
"""Asks all components, and peers, at once."""


@frozen
class Understood:
    """What components take a sentence to mean."""

    pddl: str
    kind: GoalKind
    by: tuple[str, ...]
    """The components that understand it so; this host, where it is nearly a phrase."""
    words: str = ""
    """The sentence that it is taken for; empty where PDDL was given instead."""

    def __str__(self) -> str:
        words = f'"{self.words}": ' if self.words else ""
        return f"understood by {' and '.join(self.by)} as {words}{self.kind} {self.pddl}"

    def to_dict(self) -> dict[str, object]:
        """Plain data for people's tools."""
        return {"goal": self.pddl, "kind": self.kind, "by": list(self.by), "words": self.words}


def nearly(words: str, composition: Composition, *, is_slip_taken: bool) -> Understood | None:
    """The only phrase that words are nearly; it takes its time, and is to be confirmed. Where no
    slip is taken, only courtesies may be around it.

    Raises `GoalRefused` (TRANSLATION_AMBIGUOUS) where several are near.
    """
    found = nearest(composition.book, words)
    near = [one for one in found if is_slip_taken or not one.distance]
    readings = [_as_phrase(one, composition.host) for one in near]
    if len(readings) > 1:
        said = " or ".join(f'"{one.words}"' for one in near)
        raise GoalRefused(_ambiguous(words, readings, fix=f"say {said}"))
    return readings[0] if readings else None


def _as_phrase(near: Near, host: str) -> Understood:
    goal = near.reading.goal
    return Understood(goal_text(goal.expr), goal.kind, (host,), near.words)


async def translated(
    words: str,
    refused: GoalRefused,
    ask: Asked,
    composition: Callable[[], Composition],
    *,
    deadline_s: float,
) -> Understood:
    """Have components translate what matched no phrase; one that hangs is cut off.

    `refused` is why it did not. Raises `GoalRefused` with that, and with what is wrong with
    the answers (TRANSLATION_INVALID, TRANSLATION_REFUSED, TRANSLATION_FAILED, TRANSLATION_OVERDUE),
    or with TRANSLATION_AMBIGUOUS.
    """
    if refused.code not in UNMATCHED or len(words) > LONGEST_WORDS:
        raise refused
    answers, problems = await gathered(ask(vocabulary(composition())), deadline_s)
    found: dict[tuple[str, GoalKind], Understood] = {}
    for component, answer in sorted(answers.items()):
        try:
            one = _checked(component, answer, composition())
        except GoalRefused as wrong:
            problems += wrong.problems
            continue
        before = found.setdefault((one.pddl, one.kind), one)
        if before is not one:
            found[one.pddl, one.kind] = replace(before, by=(*before.by, component))
    readings = list(found.values())
    if len(readings) > 1:
        raise GoalRefused(_ambiguous(words, readings))
    if not readings:
        raise GoalRefused(*refused.problems, *problems)
    return readings[0]


def vocabulary(composition: Composition) -> Vocabulary:
    """What a translator is told of the words known now, shortened to fit a packet.

    `host`; `sentences` that can be said; `phrases`, the same with slots: `words`, and in `slots`
    what may be said in each, nothing where any words may; `objects`: `name`, `types`, `words`;
    `predicates` as PDDL declares them.
    """
    merged, book = composition.merged, composition.book
    told: Vocabulary = {
        "host": composition.host,
        "sentences": list(islice(book.offers(), _ENTRIES)),
        "phrases": list(islice(_phrases(book), _ENTRIES)),
        "predicates": [
            _declared(predicate)
            for predicate in islice(merged.domain.predicates.values(), _ENTRIES)
        ],
        "objects": [
            {"name": name, "types": list(found.types), "words": book.labels.get(name, "")}
            for name, found in islice(merged.objects.items(), _ENTRIES)
        ],
    }
    while len(json.dumps(told)) > VOCABULARY_BYTES:
        told = {k: v[: len(v) // 2] if isinstance(v, list) else v for k, v in told.items()}
    return told


def _phrases(book: Phrasebook) -> Iterator[dict[str, Any]]:
    """Phrases with what may be said in the slots that must be filled: all names there are. A phrase
    for one of whose slots there is no name is left out."""
    for phrase in book.phrases:
        slots = [part for part in phrase.parts if isinstance(part, Slot)]
        names = {slot.name: book.names_for(slot)[:_ENTRIES] for slot in slots}
        if all(names[slot.name] or slot.is_free for slot in slots):
            yield {"words": with_slots(phrase.parts), "slots": names}


def _declared(predicate: Predicate) -> str:
    typed = (f"?{i} - {type_text(types)}" for i, types in enumerate(predicate.parameters, 1))
    return f"({' '.join((predicate.name, *typed))})"


async def gathered(
    asked: Answers, deadline_s: float
) -> tuple[dict[str, Mapping[str, Any]], list[Problem]]:
    """The answers that say something, by component, and a problem for each that failed or is cut
    off."""
    tasks = {who: asyncio.ensure_future(answer) for who, answer in sorted(asked.items())}
    answers: dict[str, Mapping[str, Any]] = {}
    problems: list[Problem] = []
    try:
        if tasks:
            await asyncio.wait(tasks.values(), timeout=deadline_s)
        for who, task in tasks.items():
            try:
                answers |= task.result()
            except asyncio.InvalidStateError:
                told = f"no answer within {deadline_s:g} s"
                problems.append(Problem("TRANSLATION_OVERDUE", told, where=who))
            except NondumError as error:
                problems.append(_failed(who, error.problems[0]))
    finally:
        for task in tasks.values():
            task.cancel()
        await asyncio.gather(*tasks.values(), return_exceptions=True)
    return answers, problems


def _failed(who: str, problem: Problem) -> Problem:
    if problem.code in ("TRANSLATION_FAILED", "TRANSLATION_OVERDUE"):  # of a peer's component
        return replace(problem, where=f"{problem.where}@{who}")
    told = f"{problem.code} {problem.message.splitlines()[0][:200]}"
    return Problem("TRANSLATION_FAILED", told, where=who, fix=problem.fix)


def _checked(component: str, answer: Mapping[str, Any], composition: Composition) -> Understood:
    """What an answer means. Raises `GoalRefused` that names the component."""
    match answer:
        case {"words": str(meant)}:
            read = partial(composition.book.goal, meant)
        case {"pddl": str(meant)} if answer.get("kind", "achieve") in get_args(GoalKind):
            kind = cast(GoalKind, answer.get("kind", "achieve"))
            read = partial(parse_goal, meant, composition.merged, kind=kind)
        case _:
            message = f"its answer is no goal: {str(dict(answer))[:200]}"
            raise GoalRefused(Problem("TRANSLATION_INVALID", message, where=component))
    try:
        goal = read()
    except GoalRefused as refused:
        why = "; ".join(_first_line(problem) for problem in refused.problems)
        message = f"it understands {meant[:200]!r}, which means nothing here: {why}"
        raise GoalRefused(Problem("TRANSLATION_REFUSED", message, where=component)) from refused
    words = meant if "words" in answer else ""
    return Understood(goal_text(goal.expr), goal.kind, (component,), words)


def _first_line(problem: Problem) -> str:
    fix = f" → {problem.fix}" if problem.fix else ""
    return f"{problem.message.splitlines()[0]}{fix}"


def _ambiguous(words: str, readings: Iterable[Understood], fix: str = "") -> Problem:
    meanings = ", or ".join(map(str, readings))
    fix = fix or "say it in other words, or give the goal with --pddl"
    return Problem("TRANSLATION_AMBIGUOUS", f"{words!r} is {meanings}", fix=fix)
