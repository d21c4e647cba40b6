"""The host's side of a plugin on the test bench: what a daemon would do, on the bench's loop."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, Problem, WorkerFailed
from nondum.sdk.link import Link, Pending
from nondum.sdk.logs import EventHandler
from nondum.sdk.messages import Message, value_from_wire
from nondum.sdk.packets import MemoryPackets
from nondum.sdk.plugin import load
from nondum.sdk.session import Session
from nondum.sdk.streams import Consumer, Producer
from nondum.sdk.wire import PROTOCOL_VERSIONS

KEPT_MESSAGES = 1000
"""Messages of one output that wait to be read."""


class Run:
    """A behaviour at work, as the host sees it."""

    def __init__(self, pending: Pending) -> None:
        self.pending = pending
        self.state = "running"
        """running, established, succeeded, failed or halted."""
        self.problem: Problem | None = None
        """Why it failed."""
        self.progress: list[tuple[float, str]] = []
        """What it said about how far it is."""
        self.answer = ""
        """What it answered when it succeeded."""

    async def follow(self) -> None:
        """Take down how it ends."""
        try:
            self.answer = (await self.pending).get("answer", "")
            self.state = "succeeded"
        except NondumError as error:
            self.state = "halted" if error.code == "HALTED" else "failed"
            self.problem = error.problems[0] if self.state == "failed" else None


class HostSide:
    """Drives one session over packets in memory. All methods run on one loop."""

    def __init__(self, plugin: str | object, on_change: Callable[[], None]) -> None:
        """`on_change` is called after every change of the attributes."""
        self._plugin, self._on_change = plugin, on_change
        self.facts: dict[tuple[str, ...], Message | None] = {}
        """What the plugin said is true, and the values."""
        self.flowing: set[str] = set()
        """Streams that flow, by object."""
        self.logs: list[tuple[str, str]] = []
        """Level and message of what was logged."""
        self.faults: list[Problem] = []
        """Wrong messages that the plugin has sent or said, and errors that ended its conditions
        and spawned coroutines, with its lines."""
        self._places: set[str] = set()
        """The lines of all that were."""
        self.outputs: dict[str, deque[Message]] = {}
        """Unread messages, by stream object."""
        self._runs: dict[int, Run] = {}
        self._followers: set[asyncio.Task[None]] = set()
        self._consumers: list[Consumer] = []
        self._producers: dict[tuple[str, str], Producer] = {}
        ours, theirs = MemoryPackets.pair()
        self.link = Link(ours, _refuse, self._on_event, lambda: None, self._on_violation)
        self._session = Session(theirs, lambda: load(plugin))
        self._session_task = asyncio.create_task(self._session.run())
        self._handler = EventHandler(self._session.tell)

    async def start(self, welcome: Mapping[str, Any]) -> PluginDescription:
        """Greet, describe, wire all outputs, start. Raises `WorkerFailed`."""
        await self.link.hello()
        self.link.welcome(PROTOCOL_VERSIONS[0], welcome)
        answer = await self.link.request("describe", {})
        description = PluginDescription.parse(answer, where="describe")
        self._session.log.addHandler(self._handler)
        self._session.log.setLevel("INFO")
        for unit in description.units:
            for slot in unit.outputs:
                await self._collect(welcome["outputs"][slot.name], slot.type)
        await self.link.request("start", {})
        return description

    async def stop(self) -> None:
        """Stop the plugin if it still answers, and let go of everything."""
        if not self.link.is_closed:
            await self.link.request("stop", {})
        self._session.log.removeHandler(self._handler)
        for producer in self._producers.values():
            producer.close()
        self.link.close()
        await asyncio.gather(self._session_task, return_exceptions=True)
        await asyncio.gather(*self._followers)
        for consumer in self._consumers:
            consumer.close()

    async def behave(self, body: Mapping[str, Any]) -> Run:
        """Begin a behaviour."""
        run = Run(self.link.begin("behave", body))
        self._runs[run.pending.id] = run
        task = asyncio.create_task(run.follow())
        self._followers.add(task)
        task.add_done_callback(self._on_run_ended)
        return run

    async def feed(self, message: Message, stream: str, slot: str, unit: str) -> None:
        """Send a message on a stream, wired on first use; with a slot, to an optional input."""
        key = (stream, slot)
        if key not in self._producers:
            ours, theirs = MemoryPackets.pair()
            producer = self._producers[key] = Producer(message.TYPE)
            producer.connect("plugin", ours)
            body = {"stream": stream, "type": message.TYPE}
            if slot:
                body |= {"slot": slot} | ({"unit": unit} if unit else {})
            await self.link.request("consume", body, (theirs,))
        self._producers[key].send(message)

    async def _collect(self, stream: str, kind: str) -> None:
        ours, theirs = MemoryPackets.pair()
        kept = self.outputs[stream] = deque(maxlen=KEPT_MESSAGES)

        def keep() -> None:
            message = consumer.take()
            assert message is not None, "it has just arrived"
            kept.append(message)
            self._on_change()

        consumer = Consumer(kind, ours, keep, lambda violation: None)
        self._consumers.append(consumer)
        body = {"stream": stream, "type": kind, "consumer": "bench"}
        await self.link.request("produce", body, (theirs,))

    def _on_run_ended(self, task: asyncio.Task[None]) -> None:
        self._followers.discard(task)
        self._on_change()

    def _on_event(self, name: str, body: dict[str, Any], call_id: int | None) -> None:
        run = self._runs.get(call_id or 0)
        match name, run:
            case "established", Run():
                run.state = "established"
            case "progress", Run():
                run.progress.append((body["fraction"], body["text"]))
            case "know", _:
                self._know((body["predicate"], *body["arguments"]), body.get("value"))
            case "forget", _:
                self._forget((body["predicate"], *body["arguments"]))
            case "flow", _:
                change = self.flowing.add if body["flowing"] else self.flowing.discard
                change(body["stream"])
            case "fault", _:
                self._fault(Problem(**body["problem"]))
            case "condition-ended", _:
                problem = Problem(**body["problem"])
                if problem.where not in self._places:  # else it ended by what was told before
                    self._fault(problem)
            case "log", _:
                self.logs.append((body["level"], body["message"]))
        self._on_change()

    def _fault(self, problem: Problem) -> None:
        self._places.add(problem.where)
        self.faults.append(problem)

    def _know(self, fact: tuple[str, ...], value: Any) -> None:
        self.facts[fact] = None if value is None else value_from_wire(value)
        if value is not None:  # as a host does: every worker hears of values, its author too
            entry = [fact[0], list(fact[1:]), value]
            self.link.send_event("values", {"set": [entry], "unset": []})

    def _forget(self, fact: tuple[str, ...]) -> None:
        if self.facts.pop(fact, None) is not None:
            entry = [fact[0], list(fact[1:])]
            self.link.send_event("values", {"set": [], "unset": [entry]})

    def _on_violation(self, violation: NondumError) -> None:
        self.logs.append(("error", str(violation)))


async def _refuse(verb: str, *_rest: Any) -> dict[str, Any]:
    raise WorkerFailed(Problem("VERB_UNKNOWN", f"a host has no verb {verb!r}"))
