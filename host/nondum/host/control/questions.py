"""What people's tools may ask of a running host; nothing here changes it."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeVar, cast

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.journal import Since
from nondum.host.config.confinement_level import ConfinementState
from nondum.host.control.arguments import Arguments
from nondum.host.control.machine import Machine
from nondum.host.control.news import News
from nondum.host.control.rows import (
    component_row,
    drive_row,
    goals_away,
    gone_back,
    host_state,
    input_row,
    journal_row,
    offered_row,
    own_goal_row,
    payload_row,
    peers_device_row,
    problems_of,
    stream_row,
)
from nondum.host.core.elsewhere import Elsewhere
from nondum.host.core.feedback_state import NOTHING
from nondum.host.core.names import whole
from nondum.host.core.plain import Row
from nondum.host.core.records import Moment, PayloadRecord, Step
from nondum.host.core.unknown import unknown
from nondum.host.mind.mind import Mind
from nondum.host.sources.devices import view
from nondum.host.trust.vouched import UNVOUCHED, Vouched
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import GoalRefused, NondumError, Problem

TOLD = 50
"""How many of the last sentences told to people are shown."""
MOST_JOURNAL_ROWS = 100_000
LONGEST_EVERY_S = 3600
LONGEST_AGO_S = 100 * 366 * 86_400
LOOK_S = 0.5
"""What is followed is looked at no more often: goals and facts take their time."""

Version = tuple[int, int]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Questions:
    """Looks at the parts of one host. Each method is a verb."""

    catalogue: Catalogue
    mind: Mind
    workers: Workers
    standing: ConfinementState
    """At which level workers are confined."""
    news: News
    stored: Callable[[], Awaitable[list[Row]]]
    """Lists the store: `wheel`, `bytes`, `used_by` (payload keys), `sha256`."""
    warnings: Callable[[], tuple[str, ...]]
    """What every status says of this host."""
    places: Callable[[], Mapping[str, str]] = dict
    """Payload key → the peer that runs it, for those that run elsewhere."""
    vouched: Callable[[str], Vouched] = lambda _: UNVOUCHED
    """Payload key → who vouches for it."""
    shown: Callable[[], Row] = NOTHING.to_dict
    """What people without a screen are shown."""
    trusted: Callable[[], Row | None] = lambda: None
    """The active trust file, in a few words; None: there is none."""
    elsewhere: Elsewhere | None = None
    """The other hosts, if this one has to do with any."""

    machine: Callable[[], Machine] = Machine
    """Looks at the machine that this host runs on; blocks."""
    wrong_slots: Callable[[], Iterable[Problem]] = tuple
    """Of the files in device slots that stand for no device."""

    async def status(self, arguments: Arguments) -> Row:
        """The host, its payloads and its goals at a glance."""
        machine = await asyncio.to_thread(self.machine)
        snapshot, places = self.catalogue.snapshot(), self.places()
        return {
            "host": snapshot.host,
            "revision": snapshot.revision,
            "state": host_state(snapshot, places),
            "safe_mode": snapshot.safety.value,
            "warnings": [
                *self.warnings(),
                *map(_kept_out, self.mind.views.kept_out()),
                *(str(problem) for c in snapshot.components for problem in c.problems),
                *(f"{of}: {told}" for of, told in self.mind.views.troubles().items()),
                *map(_gone_back, gone_back(snapshot)),
            ],
            "trust": self.trusted(),
            "feedback": self.shown(),
            "machine": machine.to_dict(),
            "confinement": self.standing.to_dict(),
            "payloads": [
                payload_row(
                    p,
                    self.news.progress(p.key),
                    places.get(p.key, ""),
                    snapshot.rollbacks,
                    self.vouched(p.key),
                    snapshot.components,
                )
                for p in snapshot.payloads
            ],
            "drives": [drive_row(d, self.news.ahead(d.id)) for d in snapshot.drives],
            "peers": [{"peer": p.name, "address": p.address} for p in snapshot.peers],
            "goals": self.mind.views.given(),
            "told": self.mind.views.told(self.mind.people.last_number - TOLD),
        }

    async def components(self, arguments: Arguments) -> list[Row]:
        """What the robot is made of."""
        pids, since = self.workers.pids(), self.workers.since_wall_s()
        snapshot = self.catalogue.snapshot()
        payloads = {payload.key: payload for payload in snapshot.payloads}
        own = [
            component_row(
                c, snapshot.host, pids.get(c.id), payloads.get(c.payload), self.vouched(c.payload)
            )
            for c in snapshot.components
        ]
        troubles = self.mind.views.troubles()
        kept_out = {row["component"]: row["problem"] for row in self.mind.views.kept_out()}
        for row in own:
            told = [row["problem"], troubles.get(row["component"], "")]
            if why := kept_out.get(row["component"]):
                told.append(f"kept out of planning: {why}")
            told += map(str, self.workers.faults(row["component"]))
            row["problem"] = "; ".join(filter(None, told))
            row["since"] = since.get(row["component"])
            row["confinement"] = str(self.workers.launcher.level) if row["pid"] else None
        return own + [
            offered_row(offered, peer.name)
            for peer in snapshot.peers
            for offered in peer.components
        ]

    async def behaviours(self, arguments: Arguments) -> list[Row]:
        """What can be done."""
        return self.mind.views.behaviours()

    async def units(self, arguments: Arguments) -> list[Row]:
        """What there is to act with."""
        return self.mind.views.units()

    async def devices(self, arguments: Arguments) -> list[Row]:
        """What is plugged in, and who has it."""
        snapshot = self.catalogue.snapshot()
        peers = (
            (device, owner) for peer in snapshot.peers for device, owner in peer.devices.items()
        )
        own = view.rows_of(snapshot)
        return own + [peers_device_row(device, owner) for device, owner in peers]

    async def devices_why(self, arguments: Arguments) -> list[Row]:
        """Every device of this host, and how it fared with every rule of every component."""
        return view.why_rows(self.catalogue.snapshot())

    async def device_slots(self, arguments: Arguments) -> list[Row]:
        """What is wrong with files that are to stand for devices: problems."""
        return [problem.to_dict() for problem in self.wrong_slots()]

    async def known_devices(self, arguments: Arguments) -> list[Row]:
        """What was ever plugged in here, as far as is remembered; what was seen last comes last."""
        return [view.known_row(known) for known in self.catalogue.snapshot().known_devices]

    async def streams(self, arguments: Arguments) -> list[Row]:
        """The streams: the producer, the readers and the rate of each."""
        rates = self.workers.rates()
        listing = self.workers.streams.listing()
        return [stream_row(stream, rates.get(stream.stream)) for stream in listing]

    async def inputs(self, arguments: Arguments) -> list[Row]:
        """The optional inputs, and what feeds each."""
        streams = self.workers.streams
        return [input_row(choice, streams.sources()) for choice in streams.inputs()]

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

    async def journal(self, arguments: Arguments) -> list[Row]:
        """What happened, oldest first; with `since_s`, in the last `since_s` seconds."""
        return await self._journal(arguments)

    async def logs(self, arguments: Arguments) -> list[Row]:
        """What components have written, by time; with `since_s`, in the last `since_s` seconds.

        Raises `NondumError` (COMPONENT_UNKNOWN).
        """
        return self._logs(arguments)

    async def store(self, arguments: Arguments) -> list[Row]:
        """The wheels that are kept, and which payloads need them."""
        ids = {payload.key: payload.payload_id for payload in self.catalogue.snapshot().payloads}
        rows = await self.stored()
        return [{**row, "used_by": [ids.get(key, key) for key in row["used_by"]]} for row in rows]

    async def _journal(self, arguments: Arguments, *, after: int = 0) -> list[Row]:
        limit = arguments.number("limit", 200, at_least=1, at_most=MOST_JOURNAL_ROWS)
        since = _moment(arguments)
        entries = await self.catalogue.journal(
            subject=arguments.optional_text("subject"),
            after=after,
            since=Since(self.catalogue.boot, since) if since else None,
            limit=MOST_JOURNAL_ROWS if after else limit,
        )
        return [journal_row(entry) for entry in entries]

    def _logs(self, arguments: Arguments, *, after: int = 0) -> list[Row]:
        logs, named = self.workers.logs, arguments.optional_text("component")
        known = {*logs.components(), *(c.id for c in self.catalogue.snapshot().components)}
        if named is not None and named not in known:
            raise NondumError(unknown("component", named, known))
        since = _moment(arguments)
        rows = [
            {"component": name, "when": line.at.wall_s, "level": line.level, "message": line.text}
            for name in ([named] if named else logs.components())
            for line in logs.of(name, after)
            if since is None or line.at.monotonic_s >= since.monotonic_s
        ]
        return sorted(rows, key=lambda row: cast(float, row["when"]))

    # Following

    async def follow_journal(self, arguments: Arguments) -> AsyncIterator[Row]:
        """An entry after the other: what `journal` answers, and what comes."""
        after, loss = 0, self.catalogue.loss
        while True:
            commits = self.catalogue.commits
            if loss is not self.catalogue.loss:  # another file, which counts from 1 again
                after, loss = 0, self.catalogue.loss
            for row in await self._journal(arguments, after=after):
                after = cast(int, row["id"])
                yield row
            await self.catalogue.changed(commits)

    async def follow_logs(self, arguments: Arguments) -> AsyncIterator[Row]:
        """A line after the other: what `logs` answers, and what comes.

        To who reads more slowly than lines come, those are lost that are not kept any more. Raises
        `NondumError` (COMPONENT_UNKNOWN).
        """
        after = 0
        while True:
            version = self.workers.logs.version
            for row in self._logs(arguments, after=after):
                yield row
            after = version
            await self.workers.logs.changed(version)

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

    async def _each_change(self, look: Callable[[], Awaitable[T]]) -> AsyncIterator[T]:
        """What is seen of the mind now, and after each change of it; `LOOK_S` apart at least."""
        version = -1
        while True:
            version = await self.mind.changed(version)
            yield await look()
            await asyncio.sleep(LOOK_S)

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

    async def watch(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Everything at a glance, now and whenever the host looks different; with `every_s`, at
        least so often."""
        every_s = arguments.number("every_s", 0, at_least=0, at_most=LONGEST_EVERY_S)
        version = None
        while True:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(every_s or None):
                    version = await self.changed(version)
            yield {
                **await self.status(arguments),
                "components": await self.components(arguments),
                "streams": await self.streams(arguments),
                "inputs": await self.inputs(arguments),
                "plan": self.mind.views.plan(),
                "tree": self.mind.views.tree(),
            }

    async def changed(self, since: Version | None = None) -> Version:
        """Wait for either the mind or the news to be at another version, and give it."""
        since = since or (-1, -1)
        waiting = [
            asyncio.create_task(self.mind.changed(since[0])),
            asyncio.create_task(self.news.changed(since[1])),
        ]
        try:
            await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in waiting:
                task.cancel()
            await asyncio.gather(*waiting, return_exceptions=True)
        return self.mind.version, self.news.version


def _moment(arguments: Arguments) -> Moment | None:
    """The moment that is `since_s` seconds ago, by both clocks; None: no such bound is given."""
    ago_s = arguments.number("since_s", 0, at_least=0, at_most=LONGEST_AGO_S)
    return Moment(time.monotonic() - ago_s, time.time() - ago_s) if ago_s else None


def _gone_back(payload: PayloadRecord) -> str:
    return (
        f"{payload.payload_id} is at release {payload.release}: a person went back to it; "
        f"`nondum retry {payload.payload_id}` goes forward again"
    )


def _kept_out(row: Row) -> str:
    return f"{row['component']} is kept out of planning: {row['problem']}"
