"""What a behaviour, condition or hook is given: arguments, devices, streams, facts, progress.

Coroutines get a `Context`; plain functions, which run in threads, get a `ThreadContext` with the
same names, whose calls wait. Names of units and streams are objects of planning throughout.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Coroutine, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from nondum.sdk.errors import BehaviourFailed, MessageInvalid, Problem
from nondum.sdk.faults import Faults
from nondum.sdk.messages import Message, value_to_wire
from nondum.sdk.ports import InputPort, OutputPort
from nondum.sdk.raised import module_of, raised_in
from nondum.sdk.workplace import Data, Device, Workplace

_M = TypeVar("_M", bound=Message)


class OutputStream:
    """An output slot, opened for sending."""

    def __init__(self, port: OutputPort, faults: Faults) -> None:
        self._port = port
        self.faults = faults
        """Tells of wrong messages (the SDK's own)."""

    @property
    def stream(self) -> str:
        """The stream's object name."""
        return self._port.stream

    def send(self, message: Message) -> None:
        """Hand a message to everyone who reads the stream; never waits.

        A consumer that is slow gets the newest message when it is ready again. Bulk data are copied
        (or sent) before this returns.
        Raises `TypeError` for a message of another type, `MessageInvalid` for wrong fields or
        values. Both are told to the host, with the author's line.
        """
        self.faults.watch(self.pass_on, message)

    def pass_on(self, message: Message) -> None:
        """Send, and leave it to the caller to tell of what is wrong (the SDK's own)."""
        self._port.send(message)


class InputStream(Generic[_M]):
    """A stream opened for reading: `async for message in stream`, newest wins.

    It never ends: while nothing is wired, it waits. It begins with the newest message if that has
    just arrived.
    """

    def __init__(self, port: InputPort) -> None:
        self._port = port
        self._seen = port.seen_by_newcomers()

    @property
    def is_connected(self) -> bool:
        """Whether a producer is wired to it now."""
        return bool(self._port.stream)

    @property
    def latest(self) -> _M | None:
        """The newest message, whether seen before or not; None when there is none (any more)."""
        return self._port.newest() if self._port.stream else None  # type: ignore[return-value]  # the caller knows the class

    async def next(self, timeout_s: float | None = None) -> _M:
        """Wait for a message that this stream has not given yet.

        Raises `TimeoutError` when none comes within `timeout_s`.
        """
        async with asyncio.timeout(timeout_s):
            while True:
                while self._seen == self._port.arrivals:
                    await self._port.arrival()
                self._seen = self._port.arrivals
                message = self._port.newest()
                if message is not None:
                    return message  # type: ignore[return-value]  # the caller knows the class

    async def __aiter__(self) -> AsyncIterator[_M]:
        while True:
            yield await self.next()


class Context:
    """What a coroutine is given. Use it on the worker's loop only."""

    def __init__(
        self,
        workplace: Workplace,
        log: logging.Logger,
        *,
        unit: str = "",
        arguments: Mapping[str, str] | None = None,
        call_id: int | None = None,
        predicates: frozenset[str] | None = None,
    ) -> None:
        self._workplace = workplace
        self.faults = Faults(workplace.fault, log)
        """Tells of wrong messages (the SDK's own)."""
        self._call_id = call_id
        self._predicates = predicates
        self._known: dict[tuple[str, ...], None] = {}
        self._tasks: set[asyncio.Task[Any]] = set()
        self._opened = contextlib.ExitStack()
        self._outputs: dict[str, OutputStream] = {}
        self.unit = unit
        """Object name of the acting unit; empty in hooks and conditions."""
        self.arguments: Mapping[str, str] = dict(arguments or {})
        """The action's parameters, without question marks → objects."""
        self.log = log
        """Goes to the host's logs."""

    @property
    def host(self) -> str:
        """The host's name, which is also its object and body frame."""
        return self._workplace.place.host

    @property
    def component(self) -> str:
        """The component's name on this host."""
        return self._workplace.place.component

    @property
    def objects(self) -> Mapping[str, str]:
        """Local names of units and output slots → objects."""
        return {**self._workplace.place.outputs, **self._workplace.place.units}

    @property
    def settings(self) -> Mapping[str, Any]:
        """The component's settings: the manifest's, with what the integrator changed."""
        return self._workplace.place.settings

    @property
    def scratch(self) -> Path:
        """A folder of the component's own, emptied when it is removed."""
        return self._workplace.place.scratch

    def device(self, name: str) -> Device | None:
        """The device that was granted for a declared need; None while there is none."""
        return self._workplace.devices.get(name)

    def data(self, name: str) -> Data | None:
        """The data that are shown for a declared need; None while there are none."""
        return self._workplace.data.get(name)

    def input(self, stream: str) -> InputStream[Any]:
        """Open a stream that the action reads, by its object."""
        return InputStream(self._workplace.input(stream))

    def optional_input(self, slot: str, unit: str | None = None) -> InputStream[Any]:
        """Open an optional input, which may never give anything.

        `unit` defaults to the acting one. Raises `LookupError` when it was not declared.
        """
        return InputStream(self._workplace.optional_input(slot, unit or self.unit or None))

    def output(self, name: str) -> OutputStream:
        """Open an output, by stream object or slot; its flow ends with the last who opened it.

        Raises `LookupError` when the plugin has no such output.
        """
        port = self._workplace.output(name)
        if port.stream not in self._outputs:
            port.open()
            self._opened.callback(port.release)
            self._outputs[port.stream] = OutputStream(port, self.faults)
        return self._outputs[port.stream]

    async def established(self) -> None:
        """Say that the effects of a lasting behaviour hold, from now until it ends."""
        self._workplace.tell("established", {}, self._call_id)

    def progress(self, fraction: float, text: str = "") -> None:
        """Say how far the behaviour is: 0..1, and in words."""
        body = {"fraction": min(max(float(fraction), 0.0), 1.0), "text": text}
        self._workplace.tell("progress", body, self._call_id)

    def know(self, predicate: str, *objects: str, value: Message | None = None) -> None:
        """Say that a fact is true, with its value if the predicate is valued.

        Raises `ValueError` in a condition that does not declare the predicate, `MessageInvalid`
        for a wrong value, or one of another type than the fragments declare (`:valued`). The host
        is told of a wrong value, with the author's line.
        """
        self.faults.watch(self.say, predicate, *objects, value=value)

    def say(self, predicate: str, *objects: str, value: Message | None = None) -> None:
        """Do as `know`, and leave it to the caller to tell of what is wrong (the SDK's own)."""
        self._may_say(predicate)
        body: dict[str, Any] = {"predicate": predicate, "arguments": list(objects)}
        if value is not None:
            self._check_type(predicate, value)
            body["value"] = value_to_wire(value)
        self._known[predicate, *objects] = None
        self._workplace.tell("know", body, self._call_id)

    def forget(self, predicate: str, *objects: str) -> None:
        """Say that a fact is not true any more. Raises `ValueError` as `know` does."""
        self._may_say(predicate)
        self._known.pop((predicate, *objects), None)
        body = {"predicate": predicate, "arguments": list(objects)}
        self._workplace.tell("forget", body, self._call_id)

    def value(self, predicate: str, *objects: str) -> Any:
        """The newest value of a valued fact.

        Raises `BehaviourFailed` (VALUE_UNKNOWN) when the fact is not known.
        """
        try:
            return self._workplace.values[predicate, *objects]
        except KeyError:
            fact = " ".join((predicate, *objects))
            raise BehaviourFailed(f"no value of ({fact}) is known", code="VALUE_UNKNOWN") from None

    def transform(self, value: _M, to: str) -> _M:
        """Give a Bearing, Pose or Twist in another frame. Raises `FrameUnknown`, `TypeError`."""
        return self._workplace.frames.transform(value, to)

    async def sleep(self, seconds: float) -> None:
        """Wait."""
        await asyncio.sleep(seconds)

    def spawn(self, work: Coroutine[Any, Any, Any]) -> None:
        """Run a coroutine beside, until the behaviour (for `start`: the worker) ends.

        One that ends with an error is told with its line, and nothing else ends.
        """
        module = module_of(work)
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(partial(self._on_spawned_done, module))

    async def close(self, *, forget: bool = False) -> None:
        """End what the context opened and spawned; the SDK calls it.

        `forget` retracts the facts that were said with it.
        """
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._opened.close()
        self._outputs.clear()
        if forget:
            for predicate, *objects in tuple(self._known):
                self.forget(predicate, *objects)

    def _check_type(self, predicate: str, value: Message) -> None:
        declared = self._workplace.value_types.get(predicate)
        if declared is not None and declared != value.TYPE:
            raise MessageInvalid(
                Problem(
                    "MESSAGE_TYPE",
                    f"the value of {predicate} is of another type than its fragment declares",
                    need=declared,
                    have=value.TYPE,
                )
            )

    def _may_say(self, predicate: str) -> None:
        if self._predicates is not None and predicate not in self._predicates:
            raise ValueError(f"this condition does not declare the predicate {predicate!r}")

    def _on_spawned_done(self, module: str, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        error = None if task.cancelled() else task.exception()
        if error is None:
            return
        self.log.error("a spawned coroutine ended with an error", exc_info=error)
        if not isinstance(error, MessageInvalid):  # that has been told where it was sent
            self._workplace.fault(raised_in("SPAWNED_RAISED", error, module))
