"""What people's tools may have a host do about goals: give, say, halt, resume."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, cast, get_args

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments
from nondum.host.control.committed import until_committed
from nondum.host.control.news import News
from nondum.host.control.rows import own_goal_row
from nondum.host.core.elsewhere import Elsewhere
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.core.row import Row
from nondum.host.core.status import coming_in
from nondum.host.mind import translation
from nondum.host.mind.composition import Composition
from nondum.host.mind.goals import HIGHEST_PRIORITY, GivenGoal
from nondum.host.mind.mind import Mind
from nondum.host.mind.preview import Preview
from nondum.host.mind.translation import Understood
from nondum.host.people.conversation import Reply, Take
from nondum.host.people.goal_files import GoalFiles, why_kept
from nondum.host.people.reading_back import read_back
from nondum.host.people.stopping import Stopped, Stopping, is_stop_for_stranger, said_to
from nondum.host.workers.workers import Workers
from nondum.planning.merge.goal import GoalKind, parse_goal
from nondum.planning.words.stop_words import is_stop
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.frozen import frozen

NOT_YET = translation.UNMATCHED | {"GOAL_TOO_EARLY"}
"""Refusals of words that may mean something once more has come."""


@frozen
class GoalOrders:
    """Each method that takes arguments is a verb."""

    catalogue: Catalogue
    mind: Mind
    workers: Workers
    news: News
    stopping: Stopping
    stop_all: Callable[[], Awaitable[Stopped]]
    """Stops this host, and the peers that go by what is said here."""
    answer: Reply
    """Answers what people ask about the robot itself."""
    take: Take
    """Makes goals of words that are heard, here or at a peer."""
    translate_s: float
    """Time that components and peers have to translate words."""
    goal_files: Callable[[], GoalFiles]
    """Keeps words that mean nothing yet."""
    elsewhere: Elsewhere | None
    """The other hosts, if this one has to do with any."""

    async def goal(self, arguments: Arguments) -> Row:
        """Give a goal, in `words` or in `pddl` (then `said` are the words it was understood from).

        Words that only a peer can have, or that begin with its name, are given to it: `host` says
        whose goal it is. Words that match no phrase are translated; with `yes` the goal is given as
        it was understood, else the answer has `understood`, for the person to confirm, and what the
        robot `would` do. With
        `keep`, words that mean nothing yet are kept; with `wait`, while anything is being brought
        in. Words that stop the robot do, and the answer has `stopped` only; a question about itself
        is answered, with `answer` only. Raises `GoalRefused`.
        """
        words, pddl = arguments.optional_text("words"), arguments.optional_text("pddl")
        if (words is None) == (pddl is None):
            raise GoalRefused(Problem("GOAL_FORM", "a goal is given in words, or in PDDL"))
        if words is not None and (done := await self._done_at_once(words)) is not None:
            return done
        kind = cast(GoalKind | None, arguments.choice("kind", *get_args(GoalKind)))
        highest = HIGHEST_PRIORITY
        priority = arguments.number("priority", 0, at_least=-highest, at_most=highest)
        said = arguments.optional_text("said")
        if words is not None:
            ours = await self._without_name(words, priority)
            if not isinstance(ours, str):
                return ours
            words = ours
        try:
            given = self.mind.give(words=words, pddl=pddl, kind=kind, priority=priority, said=said)
        except GoalRefused as refused:
            if words is None:
                raise
            return await self._given_as_translated(words, priority, refused, arguments)
        return await self._committed(given)

    async def _done_at_once(self, words: str) -> Row | None:
        """What becomes of words that stop the robot, or ask it about itself."""
        if is_stop(words):
            return {"stopped": (await self.stop_all()).to_dict()}
        answer = await self.answer(words)
        return None if answer is None else {"answer": answer}

    async def _without_name(self, words: str, priority: int) -> str | Row:
        """The words without this host's name; or what becomes of words that a peer is given, or
        that stop the robot behind a name."""
        if self.elsewhere is not None:
            peer, words = await self.elsewhere.addressee(words)
            if peer is not None:
                return await self.elsewhere.give(peer, words, priority)
        else:
            words = self._unaddressed(words)
        if is_stop(words):
            return {"stopped": self.stopping.stop().to_dict()}
        if is_stop_for_stranger(words, self.mind):
            return {"stopped": (await self.stop_all()).to_dict()}
        return words

    async def _given_as_translated(
        self, words: str, priority: int, refused: GoalRefused, arguments: Arguments
    ) -> Row:
        try:
            has_person = not (arguments.flag("yes") or arguments.flag("keep"))
            understood = await self._nearly(words, refused, is_slip_taken=has_person)
            understood = understood or await self.translated(words, refused)
        except GoalRefused as unknown:
            return self._kept(words, priority, unknown, arguments)
        if not arguments.flag("yes"):
            would = await self._previewed(understood)
            said = read_back(understood.words or understood.pddl, would)
            return {
                "understood": understood.to_dict(),
                "would": {**would.to_dict(), "said": said},
            }
        self.mind.people.tell(f"{words!r} is {understood}")
        given = self.mind.give(
            pddl=understood.pddl, kind=understood.kind, priority=priority, said=words
        )
        return await self._committed(given) | {"understood": understood.to_dict()}

    async def _committed(self, given: GivenGoal) -> Row:
        await until_committed(
            self.catalogue, self.news, lambda snapshot: self._is_kept(given, snapshot)
        )
        return self._row(given)

    async def say(self, arguments: Arguments) -> Row:
        """Take words as if they had been heard: `answer` says what becomes of them.

        Raises `GoalRefused`.
        """
        words = arguments.text("words")
        answer = await self.answer(words)
        return {"answer": answer if answer is not None else await self.take_words(words)}

    async def take_words(self, words: str) -> str:
        """Take a person's words as a goal: the answer, in words. Words that mean nothing yet are
        kept while anything is being installed. Raises `GoalRefused`."""
        try:
            return await self.take(words)
        except GoalRefused as refused:
            coming = coming_in(self.catalogue.snapshot())
            if refused.code not in NOT_YET or not coming:
                raise
            if self.elsewhere is None:
                words = self._unaddressed(words)
            else:
                peer, words = await self.elsewhere.addressee(words)
                if peer is not None:
                    raise
        given = self._keep(words, is_translated=False, while_coming=True)
        return f"that is kept as goal {given.id}, for {coming}"

    async def resume(self, arguments: Arguments) -> Row:
        """Take up a halted goal again, `id`. Raises `GoalRefused` (GOAL_NOT_HALTED, …)."""
        given = self.mind.resume(arguments.text("id"))
        await until_committed(
            self.catalogue, self.news, lambda snapshot: self._is_kept(given, snapshot)
        )
        return self._row(given)

    async def halt(self, arguments: Arguments) -> Row:
        """Halt a goal, or everything: the goals that were open, the behaviours that ran."""
        now, id = arguments.flag("now"), arguments.optional_text("id")
        if now and id is None:
            return self.stopping.stop().to_dict()
        open_goals = [goal.id for goal in self.mind.queue if not goal.state.is_final]
        halted = self.mind.halt(id=id, now=now)
        if now:
            self.workers.halt_all()
        goals = [goal for goal in open_goals if id in (None, goal)]
        return {"goals": goals, "halted": list(halted), "peers": []}

    async def _nearly(
        self, words: str, refused: GoalRefused, *, is_slip_taken: bool
    ) -> Understood | None:
        """The phrase that words are nearly. Raises `GoalRefused`."""
        composition = self.mind.composition
        if composition is None or refused.code not in translation.UNMATCHED:
            return None
        nearly = partial(translation.nearly, is_slip_taken=is_slip_taken)
        return await asyncio.to_thread(nearly, words, composition)

    async def translated(self, words: str, refused: GoalRefused) -> Understood:
        """What components take words to mean that match no phrase. Raises `GoalRefused`."""

        if self.mind.composition is None:
            raise refused

        def composition() -> Composition:
            assert self.mind.composition is not None, "there is always another one"
            return self.mind.composition

        return await translation.translated(
            words,
            refused,
            lambda vocabulary: {
                **self.mind.plugins.translations(words, vocabulary),
                **(self.elsewhere.translations(words, vocabulary) if self.elsewhere else {}),
            },
            composition,
            deadline_s=self.translate_s,
        )

    async def _previewed(self, understood: Understood) -> Preview:
        """What would become of a goal that a person has not confirmed yet."""
        if self.mind.composition is None:
            return Preview("unknown")
        kind, merged = understood.kind, self.mind.composition.merged
        try:
            goal = parse_goal(understood.pddl, merged, kind=kind)
        except GoalRefused:  # what it speaks of has just gone
            return Preview("unknown")
        return await asyncio.to_thread(self.mind.views.preview(goal))

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {"goal": self.goal, "halt": self.halt, "resume": self.resume, "say": self.say}

    def _unaddressed(self, words: str) -> str:
        """Words without this host's name, where they are said to it."""
        return said_to(words, [self.mind.beliefs.snapshot.host], self.mind)[1]

    def _row(self, given: GivenGoal) -> Row:
        return own_goal_row(self.mind.views.goal(given), self.catalogue.snapshot().host)

    def _kept(self, words: str, priority: int, refused: GoalRefused, arguments: Arguments) -> Row:
        """Keep words that mean nothing yet, where that is asked for. Raises `GoalRefused`."""
        is_kept, coming = arguments.flag("keep"), coming_in(self.catalogue.snapshot())
        more_may_come = bool(coming) or self.mind.composition is None
        if refused.code not in NOT_YET:
            raise refused
        if not is_kept and not (arguments.flag("wait") and more_may_come):
            raise _too_early(words, coming) if coming else refused
        is_translated = arguments.flag("yes")
        return self._row(
            self._keep(words, priority, is_translated=is_translated, while_coming=not is_kept)
        )

    def _keep(
        self, words: str, priority: int = 0, *, is_translated: bool, while_coming: bool
    ) -> GivenGoal:
        reason = why_kept(self.catalogue.snapshot())
        given = self.mind.keep(words, priority=priority, reason=reason)
        self.goal_files().keep(given, is_translated=is_translated, while_coming=while_coming)
        return given

    def _is_kept(self, given: GivenGoal, snapshot: Snapshot) -> bool:
        """Whether a goal would survive the daemon, or has no need to."""
        is_over = self.mind.queue[given.id].state.is_final
        return is_over or any(goal.id == given.id for goal in snapshot.goals)


def _too_early(words: str, coming: str) -> GoalRefused:
    told = f"nothing here understands {words!r} yet: {coming}"
    fix = "ask again in a moment, or have the words kept: `nondum goal --keep WORDS`"
    return GoalRefused(Problem("PHRASE_EARLY", told, fix=fix))
