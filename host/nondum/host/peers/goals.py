"""Whose goal it is what a person said or typed: this host's, or that of the one peer that can.

A compute node hears "search for people" and cannot go anywhere; the robot beside it can. Words that
begin with a host's name are that host's, whatever others could do; a stop may also end with it.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from typing import Any

from nondum.host.core.events.event import Event
from nondum.host.core.events.goals import GoalEnded, GoalReached, PlanMissing
from nondum.host.core.events.peers import PeerJoined, PeerLeft
from nondum.host.core.printable import printable
from nondum.host.core.row import Row
from nondum.host.mind.component_plugins import Answers
from nondum.host.mind.goals import HIGHEST_PRIORITY
from nondum.host.mind.mind import Mind
from nondum.host.mind.offers import prospect
from nondum.host.peers.forwarded_goals import MOST_KEPT, ForwardedGoals, goal_status, replaced
from nondum.host.peers.remote_calls import Reaches
from nondum.host.people.conversation import given_goal, wanted
from nondum.host.people.stopping import Stopped, is_stop_for_stranger, said_to
from nondum.planning.words.stop_words import STOPS, is_stop
from nondum.sdk.errors import GoalRefused, NondumError, Problem
from nondum.sdk.wire import Body
from nondum.transport.peers import CallFailed, IncomingCall

ASK_S = 2.0
"""How long a peer has to say whether it can."""
RECALL_S = 5.0
"""How long a host that has just started has to know its goals again, each time it is asked."""
RECALLS = 6
"""How often it is asked; goals that it does not know then are not there any more."""
MAX_WORDS = 1000
"""Characters of what a person said."""


class Goals:
    """Takes what a person said, here or for a peer."""

    def __init__(
        self,
        host: str,
        mind: Callable[[], Mind],
        reach: Reaches,
        peers: Callable[[], Sequence[str]],
        stop: Callable[[], Stopped],
        translations: Callable[[str, Mapping[str, Any]], Answers],
        *,
        accepts: bool,
    ) -> None:
        """`stop` stops this host; `translations` has peers translate words; `accepts`: whether
        goals that peers heard are taken."""
        self.translations = translations
        self._host, self._mind, self._reach, self._peers = host, mind, reach, peers
        self._stop = stop
        self._accepts = accepts
        self._givers: dict[str, str] = {}
        """Goal → the peer that gave it."""
        self._away = ForwardedGoals()
        self._telling: asyncio.Task[None] | None = None
        self._asking: set[asyncio.Task[None]] = set()

    # What is heard here

    async def take(self, words: str) -> str:
        """Make a goal of what was said, here or at a peer, or stop; says in words what became of
        it.

        Raises `GoalRefused` (PHRASE_…, WHOSE_GOAL), and as the peer refuses it.
        """
        if is_stop(words):
            return str(await self.stop_all())
        peer, rest = await self.addressee(words)
        if peer is not None:
            given = await self.give(peer, rest)
            if "stopped" in given:
                return f"{peer} has stopped"
            return given_goal(given, of=f" of {peer}")
        if is_stop(rest):
            return str(self._stop())
        if is_stop_for_stranger(rest, self._mind()):
            return str(await self.stop_all())
        return wanted(self._mind(), rest)

    async def addressee(self, words: str) -> tuple[str | None, str]:
        """The peer whose goal words are, None for this host; and the words without its name. Words
        that stop are never asked about.

        Raises `GoalRefused` (WHOSE_GOAL).
        """
        addressed, rest = said_to(words, (self._host, *self._peers()), self._mind())
        if addressed is not None:
            return (None if addressed == self._host else addressed), rest
        if is_stop_for_stranger(words, self._mind()):
            return None, words
        if not self._peers() or await self._prospect(words) in ("can", "holds"):
            return None, words
        return await self._able(words), words

    async def give(self, peer: str, words: str, priority: int = 0) -> Row:
        """Give a peer a goal: its row; or that it has `stopped`.

        Raises `GoalRefused`, as the peer refuses it.
        """
        args = {"words": words, "priority": priority}
        try:
            given = await self._reach.call(peer, "goal.give", args, deadline_s=ASK_S)
        except NondumError as error:
            raise GoalRefused(*error.problems) from error
        if "stopped" in given:
            return {"stopped": Stopped((), (), (peer,)).to_dict()}
        return self._away.add(peer, words, priority, given)

    def given(self) -> list[Row]:
        """The goals that were given to peers, as they were last heard of."""
        return self._away.rows()

    def follow(self, peer: str, id: str) -> AsyncIterator[Row]:
        """One of them, now and whenever there is news of it. Raises `GoalRefused`."""
        return self._away.follow(peer, id)

    async def stop_all(self) -> Stopped:
        """Stop this host at once, and then its peers: who says stop does not know who acts."""
        stopped, peers = self._stop(), self._peers()
        told = await asyncio.gather(*map(self._stopped, peers))
        return stopped.with_peers(*(peer for peer, is_so in zip(peers, told, strict=True) if is_so))

    async def _stopped(self, peer: str) -> bool:
        try:
            await self.give(peer, STOPS[0])
        except GoalRefused as refused:
            self._mind().people.tell(f"{peer} was not stopped: {refused.problems[0]}")
            return False
        return True

    async def _able(self, words: str) -> str | None:
        """The one peer that can have it; None: none can. Raises `GoalRefused` (WHOSE_GOAL)."""
        peers = self._peers()
        answers = await asyncio.gather(*(self._ask(peer, words) for peer in peers))
        for wish in ("can", "holds"):
            able = [peer for peer, now in zip(peers, answers, strict=True) if now == wish]
            if len(able) == 1:
                return able[0]
            if able:
                told = f"{' and '.join(able)} could do that"
                fix = f'say which: "{able[0]}, {words}"'
                raise GoalRefused(Problem("WHOSE_GOAL", told, fix=fix))
        return None

    async def _ask(self, peer: str, words: str) -> str:
        try:
            call = self._reach.call(peer, "goal.ask", {"words": words}, deadline_s=ASK_S)
            return str((await call).get("now", ""))
        except NondumError:
            return ""

    # What peers heard

    async def serve_ask(self, incoming: IncomingCall) -> Body:
        """Whether a peer's person can have that here: `now`, see `offers`. Raises `CallFailed`."""
        return {"now": await self._prospect(self._words(incoming))}

    def serve_give(self, incoming: IncomingCall) -> Body:
        """Take a goal that a peer heard: its `goal` id. Raises `GoalRefused`, `CallFailed`.

        Whether or not goals are taken: words that stop this host do.
        """
        said = incoming.args.get("words")
        if isinstance(said, str) and len(said) <= MAX_WORDS and is_stop(said):
            stopped = self._stop()
            self._mind().people.tell(f"{incoming.caller.name} heard {said!r}: {stopped}")
            return {"stopped": True}
        words = self._words(incoming)
        priority = _priority(incoming)
        given = self._mind().give(words=words, priority=priority)
        self._is_of(given.id, incoming.caller.name)
        self._mind().people.tell(f"{incoming.caller.name} heard {words!r}: that is goal {given.id}")
        told = {"goal": given.id, "text": given.text, "pddl": given.pddl, "kind": given.kind}
        return told | {"replaces": replaced(self._mind().views.goal(given))}

    async def serve_again(self, incoming: IncomingCall) -> Body:
        """How goals stand that a peer gave before one of the two was gone: `standings`. It is told
        of them again from now on. Raises `CallFailed`.

        A host that has just started waits for a moment until it knows its goals.
        """
        asked = _goals_asked(incoming)
        version = -1
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(RECALL_S):
                while not asked.items() <= {(goal.id, goal.text) for goal in self._mind().queue}:
                    version = await self._mind().changed(version)
        rows = [row for row in self._mind().views.given() if asked.get(row["id"]) == row["text"]]
        caller = incoming.caller.name
        rows = [row for row in rows if self._givers.get(row["id"], caller) == caller]
        for row in rows:
            if not self._mind().queue[row["id"]].state.is_final:
                self._is_of(row["id"], caller)
        return {"standings": [goal_status(row) for row in rows]}

    async def close(self) -> None:
        """Tell no one any more, and ask no one."""
        tasks = [*self._asking, *([self._telling] if self._telling is not None else [])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def on_event(self, event: Event) -> None:
        """Tell those who gave a goal what became of it."""
        match event:
            case PeerLeft(host=host):
                self._away.lose(host)
            case PeerJoined(host=host) if lost := self._away.lost(host):
                asking = asyncio.create_task(self._ask_again(host, lost))
                self._asking.add(asking)
                asking.add_done_callback(self._asking.discard)
            case GoalReached(goal):
                self._tell_giver(goal, "is reached", is_over=True)
            case GoalEnded(goal, reason):
                self._tell_giver(goal, reason, is_over=True)
            case PlanMissing(goal, problems):
                self._tell_giver(goal, "cannot be had now: " + problems[0].message, is_over=False)

    def hear_news(self, peer: str, args: Mapping[str, Any]) -> None:
        """A peer tells what became of a goal that was given from here."""
        if isinstance(text := args.get("text"), str):
            self._mind().people.tell(f"{peer}: {printable(text[:MAX_WORDS])}")

    def on_goal_status(self, peer: str, args: Mapping[str, Any]) -> None:
        """A peer tells how a goal stands that was given from here."""
        self._away.hear(peer, args)

    async def _tell_givers(self) -> None:
        """Tell how goals stand whenever that changes, as long as any is a peer's."""
        version, told = -1, dict[str, Body]()
        while self._givers:
            version = await self._mind().changed(version)
            for row in self._mind().views.given():
                giver, now = self._givers.get(row["id"]), goal_status(row)
                if giver is not None and told.get(row["id"]) != now:
                    told[row["id"]] = now
                    with contextlib.suppress(NondumError):  # it is gone, or busy
                        self._reach.notify(giver, "goal.standing", now)

    def _is_of(self, goal: str, giver: str) -> None:
        self._givers[goal] = giver
        if self._telling is None or self._telling.done():
            self._telling = asyncio.create_task(self._tell_givers())

    async def _ask_again(self, host: str, lost: Sequence[Row]) -> None:
        """Ask a peer that is back what has become of the goals that it was given."""
        goals = {row["id"]: row["text"] for row in lost}
        with contextlib.suppress(NondumError):  # it is gone again, or is older
            for _ in range(RECALLS):
                args, deadline_s = {"goals": goals}, 2 * RECALL_S
                answer = await self._reach.call(host, "goal.again", args, deadline_s=deadline_s)
                standings = answer.get("standings")
                for told in standings if isinstance(standings, list) else []:
                    if isinstance(told, dict):
                        self._away.hear(host, told)
                if not self._away.lost(host):
                    return

    def _tell_giver(self, goal: str, what: str, *, is_over: bool) -> None:
        giver = self._givers.get(goal)
        if giver is None:
            return
        if is_over:
            del self._givers[goal]
        text = f"{self._mind().queue[goal].text!r} {what}"
        rows = (row for row in self._mind().views.given() if row["id"] == goal)
        with contextlib.suppress(NondumError):  # it is gone, or busy: the goal is this host's now
            self._reach.notify(giver, "goal.news", {"text": text[:MAX_WORDS]})
            for row in rows:
                self._reach.notify(giver, "goal.standing", goal_status(row))

    def _words(self, incoming: IncomingCall) -> str:
        words = incoming.args.get("words")
        if not isinstance(words, str) or not 0 < len(words) <= MAX_WORDS:
            raise CallFailed(Problem("CALL_MALFORMED", "a goal is given in words"))
        if not self._accepts:
            fix = "the integrator says so: `accept_goals` under [peers]"
            raise CallFailed(Problem("GOALS_NOT_TAKEN", "it takes no goals from peers", fix=fix))
        return words

    async def _prospect(self, words: str) -> str:
        """`now` of what was said; empty where it means nothing here."""
        mind = self._mind()
        composition, world = mind.composition, mind.beliefs.world
        if composition is None:
            return ""
        try:
            goal = composition.book.goal(words)
        except GoalRefused:
            return ""
        return await asyncio.to_thread(prospect, composition, world.facts, world.bare_facts, goal)


def _goals_asked(incoming: IncomingCall) -> Mapping[str, str]:
    """Id → words of goals that a peer asks after. Raises `CallFailed` (CALL_MALFORMED)."""
    goals = incoming.args.get("goals")
    if not isinstance(goals, dict) or not 0 < len(goals) <= MOST_KEPT:
        told = f"at most {MOST_KEPT} goals are asked after, by id"
        raise CallFailed(Problem("CALL_MALFORMED", told))
    return {str(id): str(text) for id, text in goals.items()}


def _priority(incoming: IncomingCall) -> int:
    """That of a goal that is given. Raises `CallFailed` (CALL_MALFORMED)."""
    priority = incoming.args.get("priority", 0)
    if type(priority) is not int or abs(priority) > HIGHEST_PRIORITY:
        most = HIGHEST_PRIORITY
        raise CallFailed(Problem("CALL_MALFORMED", f"a priority is from -{most} to {most}"))
    return priority
