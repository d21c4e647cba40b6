"""A worker's side of its link: takes the host's requests and events to the plugin, and back.

The same session serves a worker process and the in-process tests of a plugin's author.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import os
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from nondum.sdk.errors import Problem, ProtocolViolation, WorkerFailed
from nondum.sdk.link import Link
from nondum.sdk.packets import Handle, Packets, adopt, discard
from nondum.sdk.performer import Performer
from nondum.sdk.plugin import Plugin, version_of
from nondum.sdk.wire import MAX_PACKET, PROTOCOL_VERSIONS, Hello
from nondum.sdk.workplace import Data, Device, Place, Workplace

HEARTBEAT_S = 2.0
CROWDED_EVERY_S = 0.5
"""Between two times that the host is told that descriptors cannot be sent."""
STOP_S = 1.5
"""What the plugin has to leave everything safe when the host is gone."""

Body: TypeAlias = dict[str, Any]


class Session:
    """One worker's life: greet, describe, start, behave, stop."""

    def __init__(
        self,
        packets: Packets,
        load_plugin: Callable[[], Plugin],
        on_beat: Callable[[], None] = lambda: None,
    ) -> None:
        """Own `packets`. `load_plugin` is called in a thread when the host asks what it is,
        `on_beat` with each sign of life."""
        self._on_beat = on_beat
        self._load_plugin = load_plugin
        self._performer: Performer | None = None
        self._workplace: Workplace | None = None
        self._welcomed = asyncio.Event()
        self._early: list[tuple[str, Body]] = []
        self._over = asyncio.Event()
        self._crowded = 0
        """Packets that could not be sent yet, since the host was last told: too many descriptors of
        this user were under way."""
        self._crowded_told_s = -math.inf
        self.log = logging.getLogger("nondum.plugin")
        self._link = Link(
            packets,
            self._on_request,
            self._on_event,
            self._over.set,
            lambda violation: self.log.error("the host broke the protocol: %s", violation),
            max_handles=1,
        )

    async def run(self) -> None:
        """Serve until the host closes the link, then leave everything safe.

        Raises `LinkClosed`, or `ProtocolViolation` for a welcome that is none.
        """
        hello = Hello(PROTOCOL_VERSIONS, version_of("nondum-sdk"), os.getpid())
        welcome = await self._link.greet(hello)
        if welcome.version not in PROTOCOL_VERSIONS:
            raise ProtocolViolation(Problem("HANDSHAKE", f"version {welcome.version} is unknown"))
        self._settle(Workplace(Place.from_wire(welcome.body), self.tell))
        heartbeat = asyncio.create_task(self._beat())
        try:
            await self._over.wait()
        finally:
            heartbeat.cancel()
            if self._performer is not None:
                with contextlib.suppress(Exception):
                    await asyncio.wait_for(self._performer.stop(), STOP_S)
            self._place.close()
            self._link.close()

    def tell(self, name: str, body: Mapping[str, Any], call_id: int | None = None) -> None:
        """Send the host an event; what cannot be sent is logged instead."""
        try:
            self._link.send_event(name, body, call_id)
        except ProtocolViolation as violation:
            self.log.error("cannot tell the host %s: %s", name, violation)

    @property
    def _place(self) -> Workplace:
        assert self._workplace is not None, "only asked for once welcomed"
        return self._workplace

    @property
    def _plugin_at_work(self) -> Performer:
        if self._performer is None:
            raise WorkerFailed(Problem("NOT_DESCRIBED", "the plugin has not been described yet"))
        return self._performer

    def _settle(self, workplace: Workplace) -> None:
        """Take the place, and what the host told before this end had read the welcome."""
        self._workplace = workplace
        self.log = logging.getLogger(f"nondum.plugin.{workplace.place.component}")
        for name, body in self._early:
            self._on_event(name, body, None)
        self._early.clear()
        self._welcomed.set()

    async def _beat(self) -> None:
        while True:
            self._on_beat()
            rates = self._place.rates(asyncio.get_running_loop().time())
            self.tell("heartbeat", {"rates": rates} if rates else {})
            await asyncio.sleep(HEARTBEAT_S)

    def _on_event(self, name: str, body: Body, _call_id: int | None) -> None:
        if self._workplace is None:
            self._early.append((name, body))
            return
        match name:
            case "values":
                self._workplace.update_values(body.get("set", []), body.get("unset", []))
            case "mounts":
                self._workplace.remount(body)
            case "ping":
                self.tell("pong", {})

    async def _on_request(
        self, verb: str, body: Body, handles: tuple[Handle, ...], call_id: int
    ) -> Body:
        await self._welcomed.wait()
        if verb in ("produce", "consume"):
            return self._wire(verb, body, handles)
        discard(handles)
        match verb:
            case "describe":
                return await self._describe()
            case "start":
                await self._plugin_at_work.start()
            case "stop":
                await self._plugin_at_work.stop()
            case "behave":
                values = body.get("values", ())
                answer = await self._plugin_at_work.behave(
                    body["behaviour"], body["arguments"], values, call_id
                )
                return {"answer": answer} if answer else {}
            case "translate_goal":
                vocabulary = body.get("vocabulary", {})
                return await self._answer(
                    "translate_goal", words=body["words"], vocabulary=vocabulary
                )
            case "speak":
                return await self._answer("speak", text=body["text"])
            case "listen":
                return await self._answer("listen")
            case "learn_words":
                return await self._answer("learn_words", vocabulary=body["vocabulary"])
            case _:
                self._rewire(verb, body)
        return {}

    async def _describe(self) -> Body:
        if self._performer is None:
            plugin = await asyncio.to_thread(self._load_plugin)
            self._performer = Performer(plugin, self._place, self.log)
        return self._performer.description.to_dict()

    async def _answer(self, hook: str, **arguments: Any) -> Body:
        return dict(await self._plugin_at_work.hook(hook, **arguments) or {})

    def _wire(self, verb: str, body: Body, handles: tuple[Handle, ...]) -> Body:
        """Connect one end of a stream to an output or input."""
        if len(handles) != 1:
            discard(handles)
            raise WorkerFailed(Problem("STREAM_HANDLE", f"{verb} needs one descriptor"))
        try:
            if verb == "produce":
                port = self._place.output(body["stream"])
                _same_type(port.producer.kind, body["type"])
                port.producer.connect(
                    body["consumer"], adopt(handles[0], MAX_PACKET, self._on_crowded)
                )
            else:
                target = self._place.input_for(body)
                target.connect(body["stream"], body["type"], adopt(handles[0], MAX_PACKET))
        except LookupError as error:
            discard(handles)
            raise WorkerFailed(Problem("STREAM_UNKNOWN", str(error))) from error
        except WorkerFailed:
            discard(handles)
            raise
        return {}

    def _on_crowded(self) -> None:
        """A frame's memory could not be handed over yet: the host finds out why."""
        self._crowded += 1
        now_s = asyncio.get_running_loop().time()
        if now_s >= self._crowded_told_s + CROWDED_EVERY_S:
            self._crowded_told_s = now_s
            self.tell("crowded", {"count": self._crowded})
            self._crowded = 0

    def _rewire(self, verb: str, body: Body) -> None:
        """Disconnect a stream, or grant or withdraw a device or data."""
        match verb:
            case "unproduce":
                self._place.output(body["stream"]).producer.disconnect(body["consumer"])
            case "unconsume":
                self._place.input_for(body).disconnect()
            case "attach":
                device = Device.from_wire(body, body.get("nodes"))
                self._place.devices[body["device"]] = device
            case "detach":
                self._place.devices.pop(body["device"], None)
            case "data" if body["shown"] is None:
                self._place.data.pop(body["need"], None)
            case "data":
                self._place.data[body["need"]] = Data.from_wire(body["shown"])
            case _:
                raise WorkerFailed(Problem("VERB_UNKNOWN", f"this SDK has no verb {verb!r}"))


def _same_type(ours: str, theirs: str) -> None:
    if ours != theirs:
        raise WorkerFailed(Problem("STREAM_TYPE", f"the output is of type {ours}, not {theirs}"))
