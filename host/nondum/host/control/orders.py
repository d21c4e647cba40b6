"""What people's tools may have a running host do."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast, get_args

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments, Triple
from nondum.host.control.news import News
from nondum.host.control.rows import gone_back, own_goal_row, payload_row
from nondum.host.control.server import Handing
from nondum.host.core.bus import Bus
from nondum.host.core.elsewhere import Elsewhere
from nondum.host.core.events import (
    DriveRetried,
    ForgetAsked,
    InputConnected,
    MountSet,
    RetryAsked,
    SafeModeLeft,
)
from nondum.host.core.names import whole
from nondum.host.core.plain import Row
from nondum.host.core.records import MountPose, PayloadRecord, Safety, Snapshot, Step
from nondum.host.core.status import coming_in, is_at_rest
from nondum.host.core.unknown import unknown
from nondum.host.lifecycle.retry_rules import is_quarantined
from nondum.host.manager import initial_components, rollback
from nondum.host.mind import translation
from nondum.host.mind.composition import Composition
from nondum.host.mind.frames import implausible
from nondum.host.mind.goals import HIGHEST_PRIORITY, GivenGoal
from nondum.host.mind.mind import Mind
from nondum.host.mind.translation import Understood
from nondum.host.people.conversation import Reply, Take
from nondum.host.people.goal_files import GoalFiles, why_kept
from nondum.host.people.stopping import Stopped, Stopping, is_stop_for_stranger, said_to
from nondum.host.workers.optional_inputs import Socket
from nondum.host.workers.workers import Workers
from nondum.planning.merge.goal import GoalKind
from nondum.planning.words.stop_words import is_stop
from nondum.sdk.errors import ConfigRefused, GoalRefused, InstallFailed, NondumError, Problem
from nondum.transport import link_sockets

COMMIT_TIMEOUT_S = 5.0
NOT_YET = translation.UNMATCHED | {"GOAL_TOO_EARLY"}
"""Refusals of words that may mean something once more has come."""

_ZEROS: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Orders:
    """Passes on to the parts of one host what people want done. Each method is a verb."""

    catalogue: Catalogue
    mind: Mind
    workers: Workers
    news: News
    bus: Bus
    stopping: Stopping
    stop_all: Callable[[], Awaitable[Stopped]]
    """Stops this host, and the peers that go by what is said here."""
    answer: Reply
    """Answers what people ask about the robot itself."""
    take: Take
    """Makes goals of words that are heard, here or at a peer."""
    translate_s: float
    """Time that components have to translate words."""
    goal_files: Callable[[], GoalFiles]
    """Keeps words that mean nothing yet."""
    elsewhere: Elsewhere | None = None
    """The other hosts, if this one has to do with any."""

    async def goal(self, arguments: Arguments) -> Row:
        """Give a goal, in `words` or in `pddl` (then `said` are the words it was understood from).

        Words that only a peer can have, or that begin with its name, are given to it: `host` says
        whose goal it is. Words that match no phrase are translated; with `yes` the goal is given as
        it was understood, else the answer has `understood` only, for the person to confirm. With
        `keep`, words that mean nothing yet are kept; with `wait`, while anything is being brought
        in. Words that stop the robot do, and the answer has `stopped` only; a question about itself
        is answered, with `answer` only. Raises `GoalRefused`.
        """
        words, pddl = arguments.optional_text("words"), arguments.optional_text("pddl")
        if (words is None) == (pddl is None):
            raise GoalRefused(Problem("GOAL_FORM", "a goal is given in words, or in PDDL"))
        if words is not None and is_stop(words):
            return {"stopped": (await self.stop_all()).to_dict()}
        if words is not None and (answer := await self.answer(words)) is not None:
            return {"answer": answer}
        kind = cast(GoalKind | None, arguments.choice("kind", *get_args(GoalKind)))
        highest = HIGHEST_PRIORITY
        priority = arguments.number("priority", 0, at_least=-highest, at_most=highest)
        said, understood = arguments.optional_text("said"), None
        if words is not None and self.elsewhere is not None:
            peer, words = await self.elsewhere.addressee(words)
            if peer is not None:
                return await self.elsewhere.give(peer, words, priority)
        elif words is not None:
            words = self._unaddressed(words)
        if words is not None and is_stop(words):
            return {"stopped": self.stopping.stop().to_dict()}
        if words is not None and is_stop_for_stranger(words, self.mind):
            return {"stopped": (await self.stop_all()).to_dict()}
        try:
            given = self.mind.give(words=words, pddl=pddl, kind=kind, priority=priority, said=said)
        except GoalRefused as refused:
            if words is None:
                raise
            try:
                understood = await self.translated(words, refused)
            except GoalRefused as unknown:
                return self._kept(words, priority, unknown, arguments)
            if not arguments.flag("yes"):
                return {"understood": understood.to_dict()}
            self.mind.people.tell(f"{words!r} is {understood}")
            given = self.mind.give(
                pddl=understood.pddl, kind=understood.kind, priority=priority, said=words
            )
        await self._until(lambda snapshot: self._is_kept(given, snapshot))
        row = self._row(given)
        return row | ({"understood": understood.to_dict()} if understood else {})

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

    def _unaddressed(self, words: str) -> str:
        """Words without this host's name, where they are said to it."""
        return said_to(words, [self.mind.beliefs.snapshot.host], self.mind)[1]

    async def resume(self, arguments: Arguments) -> Row:
        """Take up a halted goal again, `id`. Raises `GoalRefused` (GOAL_NOT_HALTED, …)."""
        given = self.mind.resume(arguments.text("id"))
        await self._until(lambda snapshot: self._is_kept(given, snapshot))
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

    async def mount(self, arguments: Arguments) -> Row:
        """Tell where a unit is mounted; what is not said stays as it was.

        Raises `ConfigRefused` (UNIT_UNKNOWN).
        """
        unit = whole(arguments.text("unit"), self.mind.names)
        known = {row["unit"] for row in self.mind.views.units()}
        if unit not in known:
            raise ConfigRefused(unknown("unit", unit, known))
        before = self.catalogue.snapshot().mount(unit)
        pose = MountPose(
            unit,
            arguments.triple("xyz") or (before.xyz if before else _ZEROS),
            arguments.triple("rpy") or (before.rpy if before else _ZEROS),
            "person",
        )
        self.bus.emit(MountSet(pose.unit, pose.xyz, pose.rpy))
        await self._until(lambda snapshot: snapshot.mount(unit) == pose)
        row = {"unit": unit, "xyz": list(pose.xyz), "rpy": list(pose.rpy)}
        return {**row, "warnings": list(implausible(pose))}

    async def connect(self, arguments: Arguments) -> Row:
        """Connect a stream to an optional input for good; without one the host picks again.

        Raises `NondumError` (INPUT_UNKNOWN, STREAM_UNKNOWN, INPUT_STREAM).
        """
        name, said = arguments.text("input"), arguments.optional_text("stream") or ""
        stream = whole(said, self.mind.names)
        sockets = {choice.socket.name: choice.socket for choice in self.workers.streams.inputs()}
        before = dict(self.catalogue.snapshot().connections)
        if name not in sockets and (stream or name not in before):
            raise NondumError(unknown("input", name, {*sockets, *before}))
        if stream:
            self._check_fits(sockets[name], stream)
        if stream != before.get(name, ""):
            self.bus.emit(InputConnected(name, stream))
            await self._until(lambda now: dict(now.connections).get(name, "") == stream)
        return {"input": name, "stream": stream or None, "was": before.get(name)}

    def _check_fits(self, socket: Socket, stream: str) -> None:
        sources = {source.stream: source for source in self.workers.streams.sources()}
        fitting = [name for name, source in sources.items() if socket.takes(source)]
        if stream not in sources:
            raise NondumError(unknown("stream", stream, fitting))
        if stream not in fitting:
            have = f"a stream of type {sources[stream].type} of {sources[stream].component}"
            raise NondumError(
                Problem(
                    "INPUT_STREAM",
                    f"{stream} cannot feed the input {socket.name}",
                    need=f"a stream of type {socket.type} of another component",
                    have=have,
                    fix=f"there is: {', '.join(fitting) or 'none'}",
                )
            )

    async def retry(self, arguments: Arguments) -> Row:
        """Try again what was refused or quarantined: a payload, by id or component.

        Raises `InstallFailed` (RETRY_UNKNOWN, RETRY_NOTHING).
        """
        name = arguments.text("name")
        snapshot = self.catalogue.snapshot()
        found = [p for p in snapshot.payloads if name in (p.payload_id, p.key, *p.components)]
        if not found:
            known = {p.payload_id for p in snapshot.payloads}
            raise InstallFailed(unknown("payload", name, known))
        troubled = [payload for payload in found if _is_troubled(payload, snapshot)]
        if not troubled:
            raise InstallFailed(Problem("RETRY_NOTHING", "nothing is wrong with it", where=name))
        for payload in troubled:
            self.bus.emit(RetryAsked(payload.key))
        return {"payloads": [payload.payload_id for payload in troubled]}

    async def leave_safe_mode(self, arguments: Arguments) -> Row:
        """Take in what was left alone; with `all`, also each payload that was refused or
        quarantined, and each drive that daemons died at. Raises `NondumError` (SAFE_MODE_OFF)."""
        snapshot, brings_all = self.catalogue.snapshot(), arguments.flag("all")
        if snapshot.safety is Safety.OFF and not brings_all:
            fix = "`nondum host resume --all` brings back what is left alone all the same"
            raise NondumError(Problem("SAFE_MODE_OFF", "this host is not in safe mode", fix=fix))
        if snapshot.safety is not Safety.OFF:
            self.bus.emit(SafeModeLeft(snapshot.host))
            await self._until(lambda snapshot: snapshot.safety is Safety.OFF)
        row: Row = {"was": snapshot.safety.value}
        return row | {"payloads": self._retry_all()} if brings_all else row

    def _retry_all(self) -> list[str]:
        """Try again all that is left alone; answers which."""
        snapshot = self.catalogue.snapshot()
        drives = [drive.id for drive in snapshot.drives if is_quarantined(drive.problems)]
        payloads = [payload for payload in snapshot.payloads if _is_troubled(payload, snapshot)]
        for id in drives:
            self.bus.emit(DriveRetried(id))
        for payload in payloads:
            self.bus.emit(RetryAsked(payload.key))
        return [*drives, *(payload.payload_id for payload in payloads)]

    async def forget(self, arguments: Arguments) -> Row:
        """Forget a payload that was here. Raises `InstallFailed` (FORGET_UNKNOWN)."""
        payload_id = arguments.text("payload")
        known = [former.key for former in self.catalogue.snapshot().former]
        if payload_id not in known:
            message = f"nothing is remembered of a payload {payload_id!r} that was here"
            fix = f"remembered are: {', '.join(sorted(known)) or 'none'}"
            raise InstallFailed(Problem("FORGET_UNKNOWN", message, fix=fix))
        self.bus.emit(ForgetAsked(payload_id))
        await self._until(
            lambda snapshot: all(former.key != payload_id for former in snapshot.former)
        )
        return {"payload": payload_id}

    async def tap(self, arguments: Arguments) -> Handing:
        """Hand the client a consumer's end of a stream. Raises `NondumError`."""
        name = whole(arguments.text("stream"), self.mind.names)
        found = {s.stream: s for s in self.workers.streams.listing()}
        if name not in found:
            raise NondumError(unknown("stream", name, found))
        ours, theirs = link_sockets()
        with ours:
            try:
                await self.workers.streams.tap(name, ours)
            except BaseException:
                theirs.close()
                raise
        return Handing({"stream": name, "type": found[name].type}, theirs)

    async def install(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Install a payload folder for good: how far it is, and at last that it is `done`.

        A client that leaves before has given it up: nothing of it stays. Raises `PayloadRefused`.
        """
        folder = Path(arguments.text("folder"))
        installing = initial_components.install(folder, self.catalogue, self.bus)
        async for row in self._told(asyncio.create_task(installing), folder.name):
            yield row

    async def rollback(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Go back to the release of a payload before: how far it is, and at last that it is `done`.

        Raises `InstallFailed` (ROLLBACK_NOTHING, …, or why the earlier release does not work).
        """
        going = rollback.go_back(arguments.text("payload"), self.catalogue, self.bus)
        async for row in self._told(asyncio.create_task(going), arguments.text("payload")):
            yield row

    async def uninstall(self, arguments: Arguments) -> Row:
        """Remove an installed payload. Raises `PayloadRefused` (NOT_INSTALLED)."""
        payload_id = arguments.text("payload")
        await initial_components.uninstall(payload_id, self.catalogue, self.bus)
        return {"payload": payload_id}

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
            lambda vocabulary: self.mind.plugins.translations(words, vocabulary),
            composition,
            deadline_s=self.translate_s,
        )

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

    async def _told(self, work: asyncio.Task[PayloadRecord], payload_id: str) -> AsyncIterator[Row]:
        """How far a payload is until work on it is done."""
        try:
            version = self.news.version
            while not work.done():
                yield {"done": False, "payload": self._payload(payload_id)}
                news = asyncio.create_task(self.news.changed(version))
                await asyncio.wait({news, work}, return_when=asyncio.FIRST_COMPLETED)
                news.cancel()
                version = self.news.version
            yield {"done": True, "payload": payload_row(work.result(), None)}
        finally:
            work.cancel()
            await asyncio.gather(work, return_exceptions=True)

    def _payload(self, payload_id: str) -> Row | None:
        """The row of a payload that is known already: of its release that is not at rest."""
        payloads = [p for p in self.catalogue.snapshot().payloads if p.payload_id == payload_id]
        found = min(payloads, key=lambda p: is_at_rest(p), default=None)
        return payload_row(found, self.news.progress(found.key)) if found else None

    async def _until(self, holds: Callable[[Snapshot], bool]) -> None:
        """Wait until what was asked for has been committed.

        Raises `InstallFailed` (CATALOGUE_BUSY) after a few seconds.
        """
        version = self.news.version
        try:
            async with asyncio.timeout(COMMIT_TIMEOUT_S):
                while not holds(self.catalogue.snapshot()):
                    version = await self.news.changed(version)
        except TimeoutError as error:
            text = "it was not committed to the catalogue in time"
            fix = "see the daemon's own log: is the disk full?"
            raise InstallFailed(Problem("CATALOGUE_BUSY", text, fix=fix)) from error


def _is_troubled(payload: PayloadRecord, snapshot: Snapshot) -> bool:
    if payload.step is not Step.ACTIVE:
        was_left = payload.step is Step.SUPERSEDED and any(
            other.payload_id == payload.payload_id for other in gone_back(snapshot)
        )
        return was_left or payload.step in (Step.REFUSED, Step.QUARANTINED)
    states = [c.state.value for c in snapshot.components if c.payload == payload.key]
    return "quarantined" in states


def _too_early(words: str, coming: str) -> GoalRefused:
    told = f"nothing here understands {words!r} yet: {coming}"
    fix = "ask again in a moment, or have the words kept: `nondum goal --keep WORDS`"
    return GoalRefused(Problem("PHRASE_EARLY", told, fix=fix))
