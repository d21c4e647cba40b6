"""What people's tools may ask about what the robot can do, believes, wants and does."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from typing import Any, TypeVar

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments
from nondum.host.control.rows import (
    goals_away,
    own_goal_row,
    problems_of,
)
from nondum.host.core.elsewhere import Elsewhere
from nondum.host.core.names import whole
from nondum.host.core.records.step import Step
from nondum.host.core.row import Row
from nondum.host.mind.mind import Mind
from nondum.host.sources.devices import view
from nondum.sdk.errors import GoalRefused, Problem
from nondum.sdk.frozen import frozen

LOOK_S = 0.5
"""What is followed is looked at no more often: goals and facts take their time."""

T = TypeVar("T")


@frozen
class MindQuestions:
    """Each method is a verb; none changes anything."""

    catalogue: Catalogue
    mind: Mind
    places: Callable[[], Mapping[str, str]]
    """Payload key → the peer that runs it, for those that run elsewhere."""
    elsewhere: Elsewhere | None
    """The other hosts, if this one has to do with any."""

    async def behaviours(self, arguments: Arguments) -> list[Row]:
        """What can be done."""
        return self.mind.views.behaviours()

    async def units(self, arguments: Arguments) -> list[Row]:
        """What there is to act with."""
        return self.mind.views.units()

    async def facts(self, arguments: Arguments) -> list[Row]:
        """What is believed; or, `parked`, what waits for objects that are not there."""
        is_parked = arguments.flag("parked")
        return self.mind.views.parked() if is_parked else self.mind.views.facts()

    async def fact(self, arguments: Arguments) -> Row:
        """One fact, true or not, and all that bears on it."""
        return self.mind.views.fact(whole(arguments.text("fact"), self.mind.names))

    async def goals(self, arguments: Arguments) -> Row:
        """What can be asked for, and what was: `given` here, `elsewhere` to peers, by `host`."""
        view = await asyncio.to_thread(self.mind.views.goals())
        host = self.catalogue.snapshot().host
        elsewhere = self.elsewhere.given() if self.elsewhere else []
        own = [own_goal_row(row, host) for row in view["given"]]
        return {**view, "given": own, "elsewhere": elsewhere}

    async def names(self, arguments: Arguments) -> Row:
        """Units and streams: whole name → the short one that people read."""
        return dict(self.mind.names)

    async def plan(self, arguments: Arguments) -> Row:
        """The plan that is carried out."""
        return self.mind.views.plan()

    async def tree(self, arguments: Arguments) -> Row:
        """The behaviour tree as last ticked."""
        return self.mind.views.tree()

    async def why(self, arguments: Arguments) -> Row:
        """Why the robot does what it does, or cannot; refused payloads and drives included."""
        given = self.elsewhere.given() if self.elsewhere else []
        view = self.mind.views.why(list(goals_away(given)))
        told = [str(problem) for problem in problems_of(self.catalogue.snapshot(), self.places())]
        return {**view, "problems": list(dict.fromkeys([*view["problems"], *told]))}

    async def composition(self, arguments: Arguments) -> Row:
        """All that planning goes by, and what is known that is not here, for tools that plan by
        themselves; `waiting` are payloads that are here and not active."""
        snapshot = self.catalogue.snapshot()
        devices = view.rows_of(snapshot)
        waiting = [
            {
                "payload": payload.payload_id,
                "version": payload.version,
                "folders": {drive: str(folder) for drive, folder in payload.sources.items()},
                "problems": [problem.to_dict() for problem in payload.problems],
            }
            for payload in snapshot.payloads
            if payload.step not in (Step.ACTIVE, Step.SUPERSEDED)
        ]
        return {**self.mind.views.composition(), "devices": devices, "waiting": waiting}

    async def follow_goals(self, arguments: Arguments) -> AsyncIterator[Row]:
        """What can be asked for and what was, now and whenever it is something else."""
        shown = None
        async for found in self._each_change(lambda: self.goals(arguments)):
            if found != shown:
                shown = found
                yield found

    async def follow_facts(self, arguments: Arguments) -> AsyncIterator[list[Row]]:
        """What is believed, now and whenever it is something else but for its age."""
        shown = None
        async for rows in self._each_change(lambda: self.facts(arguments)):
            ageless = [{**row, "age_s": None} for row in rows]
            if ageless != shown:
                shown = ageless
                yield rows

    async def follow_goal(self, arguments: Arguments) -> AsyncIterator[Row]:
        """A goal, of this host or of the peer `host`, now and whenever it looks different.

        Raises `GoalRefused`.
        """
        id, version = arguments.text("id"), -1
        own, host = self.catalogue.snapshot().host, arguments.optional_text("host")
        if self.elsewhere is not None and host not in (None, own):
            async for row in self.elsewhere.follow(host, id):
                yield row
            return
        while True:
            version = await self.mind.changed(version)
            given = next((row for row in self.mind.views.given() if row["id"] == id), None)
            if given is None:
                raise GoalRefused(Problem("GOAL_UNKNOWN", f"there is no goal {id!r}"))
            yield own_goal_row(given, own)

    async def follow_tree(self, arguments: Arguments) -> AsyncIterator[Row]:
        """The tree, now and whenever it looks different."""
        version = -1
        while True:
            version = await self.mind.changed(version)
            yield self.mind.views.tree()

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {
            "behaviours": self.behaviours,
            "composition": self.composition,
            "fact": self.fact,
            "facts": self.facts,
            "goals": self.goals,
            "names": self.names,
            "plan": self.plan,
            "tree": self.tree,
            "units": self.units,
            "why": self.why,
        }

    def following(self) -> dict[str, Callable[[Arguments], AsyncIterator[Any]]]:
        """Verbs that go on answering."""
        return {
            "follow_facts": self.follow_facts,
            "follow_goal": self.follow_goal,
            "follow_goals": self.follow_goals,
            "follow_tree": self.follow_tree,
        }

    async def _each_change(self, look: Callable[[], Awaitable[T]]) -> AsyncIterator[T]:
        """What is seen of the mind now, and after each change of it; `LOOK_S` apart at least."""
        version = -1
        while True:
            version = await self.mind.changed(version)
            yield await look()
            await asyncio.sleep(LOOK_S)
