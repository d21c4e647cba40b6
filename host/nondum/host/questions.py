"""What people's tools may ask of a running host; nothing here changes it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import cast

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.catalogue.records import PayloadRecord, Step
from nondum.host.confinement.level import Standing
from nondum.host.control.arguments import Arguments
from nondum.host.devices import view
from nondum.host.feedback.state import NOTHING
from nondum.host.mind.mind import Mind
from nondum.host.news import News
from nondum.host.rows import (
    Row,
    component_row,
    drive_row,
    gone_back,
    host_state,
    journal_row,
    offered_row,
    payload_row,
    peers_device_row,
    problems_of,
    stream_row,
    unknown,
)
from nondum.host.trust.vouched import NOBODY, Vouched
from nondum.host.whole_names import whole
from nondum.host.workers.workers import Workers
from nondum.sdk.errors import GoalRefused, NondumError, Problem

TOLD = 50
"""How many of the last sentences told to people are shown."""
MOST_JOURNAL_ROWS = 100_000

Version = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Questions:
    """Looks at the parts of one host. Each method is a verb."""

    catalogue: Catalogue
    mind: Mind
    workers: Workers
    standing: Standing
    """At which level workers are confined."""
    news: News
    stored: Callable[[], Awaitable[list[Row]]]
    """Lists the store: `wheel`, `bytes`, `used_by` (payload keys), `sha256`."""
    warnings: Callable[[], tuple[str, ...]]
    """What every status says of this host."""
    places: Callable[[], Mapping[str, str]] = dict
    """Payload key → the peer that runs it, for those that run elsewhere."""
    vouched: Callable[[str], Vouched] = lambda _: NOBODY
    """Payload key → who vouches for it."""
    shown: Callable[[], Row] = NOTHING.to_dict
    """What people without a screen are shown."""
    trusted: Callable[[], Row | None] = lambda: None
    """The active trust file, in a few words; None: there is none."""

    async def status(self, arguments: Arguments) -> Row:
        """The host, its payloads and its goals at a glance."""
        snapshot, places = self.catalogue.snapshot(), self.places()
        return {
            "host": snapshot.host,
            "revision": snapshot.revision,
            "state": host_state(snapshot, places),
            "safe_mode": snapshot.safety.value,
            "warnings": [
                *self.warnings(),
                *map(_kept_out, self.mind.views.kept_out()),
                *map(_gone_back, gone_back(snapshot)),
            ],
            "trust": self.trusted(),
            "feedback": self.shown(),
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
        pids = self.workers.pids()
        snapshot = self.catalogue.snapshot()
        payloads = {payload.key: payload for payload in snapshot.payloads}
        own = [
            component_row(
                c, snapshot.host, pids.get(c.id), payloads.get(c.payload), self.vouched(c.payload)
            )
            for c in snapshot.components
        ]
        kept_out = {row["component"]: row["problem"] for row in self.mind.views.kept_out()}
        for row in own:
            if why := kept_out.get(row["component"]):
                told = f"kept out of planning: {why}"
                row["problem"] = "; ".join(filter(None, (row["problem"], told)))
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

    async def known_devices(self, arguments: Arguments) -> list[Row]:
        """What was ever plugged in here, as far as is remembered; what was seen last comes last."""
        return [view.known_row(known) for known in self.catalogue.snapshot().known_devices]

    async def streams(self, arguments: Arguments) -> list[Row]:
        """Who sends what to whom."""
        return [stream_row(stream) for stream in self.workers.streams.listing()]

    async def facts(self, arguments: Arguments) -> list[Row]:
        """What is believed; or, `parked`, what waits for objects that are not there."""
        is_parked = arguments.flag("parked")
        return self.mind.views.parked() if is_parked else self.mind.views.facts()

    async def fact(self, arguments: Arguments) -> Row:
        """One fact, true or not, and all that bears on it."""
        return self.mind.views.fact(whole(arguments.text("fact"), self.mind.names))

    async def goals(self, arguments: Arguments) -> Row:
        """What can be asked for, and what was."""
        return await asyncio.to_thread(self.mind.views.goals())

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
        view = self.mind.views.why()
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
        """What happened, oldest first."""
        limit = arguments.number("limit", 200, at_least=1, at_most=MOST_JOURNAL_ROWS)
        subject = arguments.optional_text("subject")
        entries = await self.catalogue.journal(subject=subject, limit=limit)
        return [journal_row(entry) for entry in entries]

    async def logs(self, arguments: Arguments) -> list[Row]:
        """What components have written, by time. Raises `NondumError` (COMPONENT_UNKNOWN)."""
        logs, named = self.workers.logs, arguments.optional_text("component")
        known = {*logs.components(), *(c.id for c in self.catalogue.snapshot().components)}
        if named is not None and named not in known:
            raise NondumError(unknown("component", named, known))
        rows = [
            {"component": name, "when": line.at.wall_s, "level": line.level, "message": line.text}
            for name in ([named] if named else logs.components())
            for line in logs.of(name)
        ]
        return sorted(rows, key=lambda row: cast(float, row["when"]))

    async def store(self, arguments: Arguments) -> list[Row]:
        """The wheels that are kept, and which payloads need them."""
        ids = {payload.key: payload.payload_id for payload in self.catalogue.snapshot().payloads}
        rows = await self.stored()
        return [{**row, "used_by": [ids.get(key, key) for key in row["used_by"]]} for row in rows]

    # Following

    async def follow_goal(self, arguments: Arguments) -> AsyncIterator[Row]:
        """A goal, now and whenever the host looks different. Raises `GoalRefused`."""
        id, version = arguments.text("id"), -1
        while True:
            version = await self.mind.changed(version)
            given = next((row for row in self.mind.views.given() if row["id"] == id), None)
            if given is None:
                raise GoalRefused(Problem("GOAL_UNKNOWN", f"there is no goal {id!r}"))
            yield given

    async def follow_tree(self, arguments: Arguments) -> AsyncIterator[Row]:
        """The tree, now and whenever it looks different."""
        version = -1
        while True:
            version = await self.mind.changed(version)
            yield self.mind.views.tree()

    async def watch(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Everything at a glance, now and whenever the host looks different."""
        version = None
        while True:
            version = await self.changed(version)
            yield {
                **await self.status(arguments),
                "components": await self.components(arguments),
                "streams": await self.streams(arguments),
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


def _gone_back(payload: PayloadRecord) -> str:
    return (
        f"{payload.payload_id} is at release {payload.release}: a person went back to it; "
        f"`nondum retry {payload.payload_id}` goes forward again"
    )


def _kept_out(row: Row) -> str:
    return f"{row['component']} is kept out of planning: {row['problem']}"
