"""All workers of a host: who is asked for behaviours, hooks, devices and streams."""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias
from weakref import WeakValueDictionary

from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.facts import FactKnown, StreamFlowing
from nondum.host.core.events.inputs import InputAmbiguous
from nondum.host.core.events.workers import WorkerFailed, WorkerLogged
from nondum.host.core.records.moment import Moment
from nondum.host.workers import problems
from nondum.host.workers.call import Call
from nondum.host.workers.extra_workers import ExtraWorkers, Granted
from nondum.host.workers.in_flight import Search
from nondum.host.workers.launcher import Launcher, WorkerLauncher
from nondum.host.workers.logs import LogLine, Logs
from nondum.host.workers.optional_inputs import Choice
from nondum.host.workers.role import Role
from nondum.host.workers.spec import Timing, WorkerSpec
from nondum.host.workers.streams import Streams
from nondum.host.workers.supervisor import Supervisor
from nondum.host.workers.usage_checks import UsageChecks
from nondum.host.workers.worker import Worker
from nondum.planning.execute.running import RunState
from nondum.planning.merge.core import core_value_types
from nondum.sdk import errors
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.transport import WorkerLink
from nondum.wheelhouse.format.limits import WorkerLimits

FactValue: TypeAlias = tuple[str, Sequence[str], Any]
"""Predicate, objects, and the value as it travels; None: it has none (any more)."""

GRACE_S = 2.0
"""What a worker has to end when its component is removed."""

log = logging.getLogger(__name__)


class Workers:
    """Starts, asks and ends workers. Make and use it on the loop; `close` it.

    What happens is told by `emit`, never from within a call of its methods but for the start of a
    behaviour.
    """

    def __init__(
        self,
        host: str,
        emit: Emit,
        *,
        launcher: Launcher | None = None,
        timing: Timing | None = None,
    ) -> None:
        self.launcher = launcher or WorkerLauncher()
        self.timing = timing or Timing()
        self._rounds = UsageChecks(self._running, self.emit, self.timing.look_s)
        self._going_round: asyncio.Task[None] | None = None
        self.streams = Streams(host, self._on_ambiguous)
        self.search = Search(self.streams.senders, self.streams.ends)
        self.logs = Logs()
        self._host, self._emit = host, emit
        self._links: dict[str, WorkerLink] = {}
        """Of the workers that may be asked for things, by component."""
        self._supervisors: dict[str, Supervisor] = {}
        self._extra_workers = ExtraWorkers()
        self._devices: dict[str, Granted] = {}
        self._granting = WeakValueDictionary[str, asyncio.Lock]()
        """Component → held while it is granted a device, or shown data."""
        self._shown: dict[tuple[str, str], dict[str, Mapping[str, Any]]] = {}
        """Component and payload → need → the data that it is shown for it."""
        self._mounts: Mapping[str, Any] = {}
        core_value_types()  # read now: a worker may be started when there is little memory
        self._call_ids = itertools.count(1)
        self._calls: dict[asyncio.Task[None], Call] = {}
        self._keeps_spare = False
        self._warm_at: asyncio.TimerHandle | None = None
        self._warming: asyncio.Task[None] | None = None

    async def start(self, spec: WorkerSpec, role: Role = Role.ACTIVE) -> PluginDescription:
        """Start a component's worker and keep one alive until `stop`.

        Beside one of another payload, or if told so, it stands for nothing until `take_over`.
        Returns once its plugin has described itself as the index says and has started. Raises
        `errors.WorkerFailed` with what went wrong, and `ValueError` when it has a worker already;
        one that is being stopped is waited for.
        """
        while (present := self._found(spec.component, spec.payload)) and present.is_alive:
            if not present.is_stopping:
                raise ValueError(f"component {spec.component!r} has a worker already")
            await present.ended()
        active = self._supervisors.get(spec.component)
        is_second = active is not None and active.spec.payload != spec.payload
        if is_second or role is Role.BESIDE:
            supervisor = Supervisor(spec, self, Role.BESIDE)
            self._extra_workers.add(supervisor)
        else:
            supervisor = self._supervisors[spec.component] = Supervisor(spec, self)
        if self._going_round is None:
            self._going_round = asyncio.create_task(self._rounds.run())
        await supervisor.start()
        return spec.index

    async def watched(self, component: str, payload: str) -> None:
        """Wait until a worker that was started was seen to be healthy for a while.

        Raises `errors.WorkerFailed` where it ended instead.
        """
        supervisor = self._found(component, payload)
        worker = supervisor.worker if supervisor is not None else None
        if worker is not None:
            await worker.wait_for_beats(self.timing.settle_beats)
        if worker is None or worker.gone.done():
            ended = worker.gone.result() if worker else problems.not_running(component)
            raise errors.WorkerFailed(ended)

    def take_over(self, owners: Mapping[str, str]) -> None:
        """Have the workers of those payloads stand for their components that the catalogue says:
        component → payload. The worker that stood for one before is ignored, and to be stopped."""
        for component, payload in owners.items():
            new = self._extra_workers.beside(component, payload)
            if new is None:
                continue
            old = self._supervisors.get(component)
            if old is not None:
                old.withdraw()
                self._extra_workers.add(old, self._devices.pop(component, {}))
            self._extra_workers.drop(new)
            self._supervisors[component] = new
            new.come_into_force()

    async def ended(self, payload: str) -> None:
        """Wait until no worker of a payload is left; somebody else stops them."""
        every = (*self._supervisors.values(), *self._extra_workers)
        await asyncio.gather(*(s.ended() for s in every if s.spec.payload == payload))

    async def restart(self, component: str) -> None:
        """Try a component that was given up once more; `WorkerReady` or `WorkerFailed` tells.

        Raises `KeyError` for a component that was never started, or has been stopped.
        """
        supervisor = self._supervisors[component]
        if supervisor.is_alive:
            return
        try:
            await supervisor.start()
        except errors.WorkerFailed as error:
            self.emit(WorkerFailed(component, error.problems, supervisor.spec.payload))

    async def stop(self, component: str, grace_s: float = GRACE_S, payload: str = "") -> None:
        """End a component's worker within `grace_s`: ask, then SIGTERM, then SIGKILL to the group.

        It is withdrawn at once: no stream, hook or behaviour reaches it any more. Unknown
        components are ignored; one that is being started is given up. Of two side by side only that
        of `payload` is ended.
        """
        supervisor = self._found(component, payload)
        if supervisor is None:
            return
        if supervisor.role is Role.ACTIVE:
            self._extra_workers.add(supervisor, self._devices.pop(component, {}))
        self._shown.pop((component, supervisor.spec.payload), None)
        try:
            await supervisor.stop(grace_s)
        finally:
            self._extra_workers.drop(supervisor)
            if self._supervisors.get(component) is supervisor:
                del self._supervisors[component]

    async def close(self, grace_s: float = GRACE_S) -> None:
        """End all workers."""
        if self._going_round is not None:
            self._going_round.cancel()
        every = (*self._supervisors.values(), *self._extra_workers)
        stopping = (self.stop(s.spec.component, grace_s, s.spec.payload) for s in every)
        await asyncio.gather(*stopping)
        await asyncio.gather(*self._calls, return_exceptions=True)
        await self.search.close()
        await self.streams.close()
        if self._warm_at is not None:
            self._warm_at.cancel()
        if self._warming is not None:
            await self._warming
        await self.launcher.close()

    def behave(
        self,
        component: str,
        behaviour: str,
        arguments: Mapping[str, str],
        values: Sequence[FactValue] = (),
    ) -> Call:
        """Ask a component for a behaviour, once the streams it reads are wired. Returns at once.

        `arguments` are the action's parameters, without question marks → objects. Raises
        `errors.WorkerFailed` (NOT_RUNNING).
        """
        worker = self._worker(component)
        call = Call(next(self._call_ids), component, behaviour, dict(arguments), self._emit)
        task = asyncio.create_task(self._carry_out(worker, call, values))
        self._calls[task] = call
        task.add_done_callback(self._calls.pop)
        return call

    def rates(self) -> dict[str, float]:
        """Stream → messages a second of late, as the workers say."""
        told: dict[str, float] = {}
        for worker in self._running():
            told |= worker.reports.rates
        return told

    def busy(self) -> frozenset[str]:
        """The components that carry something out now, for whichever host."""
        return frozenset(call.component for call in self._calls.values())

    def halt_all(self) -> None:
        """Ask every behaviour to end. Returns at once; halting is bounded."""
        for call in tuple(self._calls.values()):
            call.halt()

    def tell_values(self, component: str, values: Sequence[FactValue]) -> None:
        """Tell a component new values of facts; one that does not run is told nothing."""
        known = [[p, list(objects), value] for p, objects, value in values if value is not None]
        gone = [[p, list(objects)] for p, objects, value in values if value is None]
        self._tell([component], "values", {"set": known, "unset": gone})

    def remount(self, mounts: Mapping[str, Any]) -> None:
        """Tell every component, now and later, where all units sit: `{frame: [parent, …]}`."""
        self._mounts = mounts
        self._tell(self._supervisors, "mounts", mounts)

    async def attach(
        self,
        component: str,
        need: str,
        node: str,
        properties: Mapping[str, str],
        others: Sequence[tuple[str, Mapping[str, str]]] = (),
    ) -> None:
        """Grant a device for a declared need, to this worker and those after it, instead of what
        they had for it. `others` are further nodes of it, with their properties.

        Another worker that has it, and is being stopped, is waited for.
        """
        nodes = [{"node": n, "properties": dict(p)} for n, p in ((node, properties), *others)]
        async with self._granting.setdefault(component, asyncio.Lock()):
            for each in nodes:
                await self._extra_workers.released(str(each["node"]))
            device = {**nodes[0], "nodes": nodes}
            self._devices.setdefault(component, {})[need] = device
            await self._tell_worker(component, lambda worker: worker.attach(need, device))

    async def detach(self, component: str, need: str) -> None:
        """Withdraw a device."""
        self._devices.get(component, {}).pop(need, None)
        await self._tell_worker(component, lambda worker: worker.detach(need))

    async def show(
        self, component: str, payload: str, need: str, data: Mapping[str, Any] | None
    ) -> None:
        """Tell the worker that a payload has for a component, and those after it, which data it is
        shown for a need; None: none any more."""
        shown = self._shown.setdefault((component, payload), {})
        if data is None:
            shown.pop(need, None)
        else:
            shown[need] = data
        supervisor = self._supervisors.get(component)
        if supervisor is not None and supervisor.spec.payload == payload:
            body = {"need": need, "shown": data}
            async with self._granting.setdefault(component, asyncio.Lock()):
                await self._tell_worker(component, lambda worker: worker.link.request("data", body))

    def claims(self, component: str) -> tuple[FactKnown | StreamFlowing, ...]:
        """What a component's worker says is so now: the news of it that still hold.

        For those who begin to listen to a component after its worker has started.
        """
        supervisor = self._supervisors.get(component)
        if supervisor is None or supervisor.worker is None:
            return ()
        return tuple(supervisor.worker.reports.claims)

    def faults(self, component: str) -> tuple[Problem, ...]:
        """Mistakes of a component's plugin that its worker has outlived, the newest of those that
        have not ended a condition."""
        supervisor = self._supervisors.get(component)
        worker = supervisor.worker if supervisor is not None else None
        return tuple(worker.reports.faults) if worker is not None else ()

    def dead_conditions(self, component: str, payload: str) -> tuple[errors.Problem, ...]:
        """The conditions of a payload's worker that have ended with an error."""
        supervisor = self._found(component, payload)
        if supervisor is None or supervisor.worker is None:
            return ()
        return tuple(supervisor.worker.reports.dead_conditions.values())

    async def ask(
        self, component: str, hook: str, body: Mapping[str, Any]
    ) -> Mapping[str, Any] | None:
        """What a component's plugin answers to an acting hook; None if no worker runs.

        Raises `NondumError` where the hook fails.
        """
        link = self._links.get(component)
        if link is None:
            return None
        try:
            return await link.request(hook, body)
        except errors.LinkClosed:  # it has ended or was taken away, which its own events tell
            return None

    async def keep_spare(self) -> None:
        """Prepare the next launch, now and, from now on, some time after every launch."""
        self._keeps_spare = True
        await self.launcher.warm()

    def pids(self) -> dict[str, int]:
        """The process of each running worker, by component."""
        return {worker.spec.component: worker.pid for worker in self._running()}

    def since_wall_s(self) -> dict[str, float]:
        """When each running worker was launched, in seconds since 1970, by component."""
        return {worker.spec.component: worker.since_wall_s for worker in self._running()}

    def asked(self) -> dict[str, WorkerLimits]:
        """What each running worker's payload asked for and was granted, by component."""
        return {worker.spec.component: worker.spec.asked for worker in self._running()}

    def pids_of(self, payload: str) -> tuple[int, ...]:
        """The processes of a payload's workers, as far as they are known."""
        every = (*self._supervisors.values(), *self._extra_workers)
        mine = (s.worker for s in every if s.spec.payload == payload)
        return tuple(pid for worker in mine if worker is not None for pid in worker.pids())

    # What supervisors need

    def welcome(self, spec: WorkerSpec) -> Mapping[str, Any]:
        """What a new worker, about to be launched, is told of its place."""
        self._warm_later()
        return {
            "host": self._host,
            "component": spec.component,
            "units": spec.units(self._host),
            "outputs": spec.outputs(self._host),
            "settings": spec.settings,
            "scratch": str(spec.scratch),
            "devices": self._devices.get(spec.component, {}),
            "data": self._shown.get((spec.component, spec.payload), {}),
            "mounts": self._mounts,
            "limits": {"memory_mb": spec.limits.memory_mb, "tasks": spec.limits.tasks},
        }

    def emit(self, event: Event) -> None:
        """Keep what a worker logs, wire what begins to flow, and hand all of it on."""
        match event:
            case WorkerLogged(component, level, message):
                now = Moment(asyncio.get_running_loop().time(), time.time())
                for line in message.splitlines():
                    self.logs.add(component, LogLine(now, level, line))
            case StreamFlowing(_, stream, flowing):
                self.streams.set_flowing(stream, is_flowing=flowing)
        self._emit(event)

    def on_ready(self, worker: Worker) -> None:
        """A worker may be asked for things from now on."""
        spec = worker.spec
        self.streams.join(spec.component, worker.link, spec.index)
        for claim in worker.reports.claims:
            if isinstance(claim, StreamFlowing):
                self.streams.set_flowing(claim.stream, is_flowing=True)
        self._links[spec.component] = worker.link

    def on_gone(self, worker: Worker) -> None:
        """A worker is going or gone."""
        component = worker.spec.component
        self._links.pop(component, None)
        self.streams.leave(component)

    def _on_ambiguous(self, choice: Choice) -> None:
        self.emit(InputAmbiguous(choice.socket.component, (choice.problem(),)))

    def _found(self, component: str, payload: str) -> Supervisor | None:
        """The worker of a component that a payload has, or without one that which counts."""
        supervisor = self._supervisors.get(component)
        if supervisor is not None and payload in ("", supervisor.spec.payload):
            return supervisor
        return self._extra_workers.get(component, payload)

    def _running(self) -> list[Worker]:
        """The active workers."""
        found = (supervisor.worker for _, supervisor in sorted(self._supervisors.items()))
        return [worker for worker in found if worker is not None]

    def _warm_later(self) -> None:
        """Not while workers are being started: they need the processors."""
        if self._warm_at is not None:
            self._warm_at.cancel()
        if self._keeps_spare:
            loop = asyncio.get_running_loop()
            self._warm_at = loop.call_later(self.timing.spare_s, self._warm)

    def _warm(self) -> None:
        if self._warming is None or self._warming.done():
            self._warming = asyncio.create_task(self.launcher.warm())

    def _worker(self, component: str) -> Worker:
        supervisor = self._supervisors.get(component)
        if supervisor is None or supervisor.worker is None:
            raise errors.WorkerFailed(problems.not_running(component))
        return supervisor.worker

    async def _carry_out(self, worker: Worker, call: Call, values: Sequence[FactValue]) -> None:
        sent = [[p, list(objects), value] for p, objects, value in values if value is not None]
        try:
            await self._extra_workers.left(call.component)  # two releases do not act together
            await self._granted(worker, call)
            async with self.streams.wired(call.component, call.behaviour, call.arguments):
                if call.is_halting:
                    call.end(RunState.HALTED, "halted before it began")
                else:
                    await worker.behave(call, sent)
        except errors.NondumError as error:
            call.end(RunState.FAILED, problems.words(error))
        finally:
            call.end(RunState.FAILED, "it could not be asked")  # counts only if nothing else did

    async def _granted(self, worker: Worker, call: Call) -> None:
        """Wait for what its component is being granted, unless it is halted or the worker ends."""
        granting = self._granting.get(call.component)
        if granting is None or not granting.locked():
            return
        halted = asyncio.Event()
        call.when_halted(halted.set)
        granted = asyncio.ensure_future(granting.acquire())
        halting = asyncio.ensure_future(halted.wait())
        first: tuple[asyncio.Future[Any], ...] = (granted, halting, worker.gone)
        try:
            await asyncio.wait(first, return_when=asyncio.FIRST_COMPLETED)
        finally:
            halting.cancel()
            granted.cancel()
            (acquired,) = await asyncio.gather(granted, return_exceptions=True)
            if acquired is True:
                granting.release()

    def _tell(self, components: Iterable[str], event: str, body: Mapping[str, Any]) -> None:
        for component in components:
            supervisor = self._supervisors.get(component)
            if supervisor is not None and supervisor.worker is not None:
                try:
                    supervisor.worker.link.tell(event, body)
                except errors.ProtocolViolation as error:
                    log.warning("%s cannot be told %s: %s", component, event, error)

    async def _tell_worker(
        self, component: str, tell: Callable[[Worker], Awaitable[object]]
    ) -> None:
        try:
            await tell(self._worker(component))
        except (errors.WorkerFailed, errors.LinkClosed):
            return  # the next worker is told in its welcome
