"""One worker: a process and its link, from launch until both are gone."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from nondum.host.core.events import (
    BehaviourProgressed,
    ConditionEnded,
    Event,
    StreamFlowing,
    WorkerFaulted,
    WorkerLogged,
)
from nondum.host.core.placed import placed
from nondum.host.core.printable import printable
from nondum.host.core.shielded import until_done
from nondum.host.sandbox.cgroups import Usage
from nondum.host.sandbox.helper.grants import reachable, withdrawn
from nondum.host.workers import problems, scratch
from nondum.host.workers.call import Call
from nondum.host.workers.device_ownership import DeviceOwnership
from nondum.host.workers.faults import Faults
from nondum.host.workers.index import mismatches
from nondum.host.workers.launcher import Launcher
from nondum.host.workers.leftovers import clear_away, end_leftovers
from nondum.host.workers.limits import Reading, Watch
from nondum.host.workers.loop_stacks import Standstill
from nondum.host.workers.news import (
    Claims,
    parse_answer,
    parse_condition,
    parse_count,
    parse_news,
    parse_progress,
    parse_rates,
)
from nondum.host.workers.output import Output, Valve
from nondum.host.workers.process import WorkerProcess, names_of
from nondum.host.workers.spec import Timing, WorkerSpec
from nondum.host.workers.usage import UsageReader
from nondum.planning.execute.running import RunState
from nondum.planning.merge.core import core_value_types
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import (
    LinkClosed,
    MessageInvalid,
    NondumError,
    Problem,
    ProtocolViolation,
    WorkerFailed,
)
from nondum.sdk.link import Pending
from nondum.sdk.valued import value_types
from nondum.transport import WorkerLink, link_sockets

OnCrowded: TypeAlias = Callable[[int], None]
CROWDED_S, CROWDED_TRIES = 0.1, 50
"""Between attempts to start a worker while no descriptor can be handed to it, and how many."""
TAIL_LINES = 12
"""Lines of standard error that are told with an exit."""
LINE_COST = 64
"""Bytes that each logged line counts for beside its own."""


class Worker:
    """A launched worker. `start_worker` sees it through its start."""

    def __init__(
        self,
        spec: WorkerSpec,
        process: WorkerProcess,
        link: socket.socket,
        timing: Timing,
        emit: Callable[[Event], None],
        on_crowded: OnCrowded = lambda count: None,
    ) -> None:
        """Take over its process, and the host's end of its link.

        Raises `OSError` when they cannot be read: then they are still the caller's.
        `on_crowded` is called with how often descriptors could not be sent to it, or by it.
        """
        self._on_crowded = on_crowded
        self.spec, self._timing, self._emit = spec, timing, emit
        self.since_wall_s = time.time()
        """When it was launched, in seconds since 1970."""
        self.claims = Claims()
        """What it says is so."""
        self.faults = Faults()
        """Mistakes of its plugin that did not end it."""
        self._value_types = {**core_value_types(), **value_types(spec.index.fragments)}
        self._streams: frozenset[str] = frozenset()
        self._beats = 0
        self.rates: dict[str, float] = {}
        """Messages a second of each of its streams, as its last heartbeat says."""
        self._beaten = asyncio.Event()
        self._loop = asyncio.get_running_loop()
        self._calls: dict[int, Call] = {}
        self._reached: set[str] = set()
        """Names by which a node may have been made for it, to be removed with it."""
        self._granted: dict[str, dict[str, str]] = {}
        """Need → name → node that it has by that name."""
        self._lending = DeviceOwnership(process.user)
        self._tail: deque[str] = deque(maxlen=TAIL_LINES)
        self._standstill = Standstill(spec.entry_point.partition(":")[0].partition(".")[0])
        self.dead_conditions: dict[str, Problem] = {}
        """Condition → the error that it ended with."""
        self._ending: asyncio.Task[None] | None = None
        self._watchdog: asyncio.TimerHandle | None = None
        self.gone: asyncio.Future[Problem] = self._loop.create_future()
        """Why the worker ended, once nothing of it is left."""
        self._log_valve = Valve(self._loop.time)
        self._watch = Watch(spec.component, spec.limits, timing.spin_s)
        self._process = process
        self._gauge = UsageReader(lambda: self.pid, self._process.cgroup)
        self._outputs: list[Output] = []
        with contextlib.ExitStack() as failed:
            failed.callback(self._close_outputs)
            for source, pipe in zip(("stdout", "stderr"), self._process.outputs, strict=True):
                self._outputs.append(Output(source, pipe, self._on_line))
            self.link = WorkerLink(
                link,
                on_event=self._on_event,
                on_closed=self._on_hang_up,
                on_violation=self._on_foul,
                on_crowded=lambda: on_crowded(1),
            )
            failed.pop_all()
        self._process.exited.add_done_callback(lambda _: self._on_hang_up())

    @property
    def pid(self) -> int:
        """The process's id."""
        return self._process.pid

    def pids(self) -> tuple[int, ...]:
        """All its processes, as far as they are known."""
        return self._gauge.pids()

    @property
    def is_in_cgroup(self) -> bool:
        """Whether all its processes are known."""
        return self._gauge.is_whole

    async def introduce(self, welcome: Mapping[str, Any]) -> None:
        """Greet it, hear what it is, compare that with the index, and have the plugin start.

        Raises `WorkerFailed`, `ProtocolViolation`, `LinkClosed`.
        """
        self._streams = frozenset(welcome["outputs"].values())
        devices = {need: await self._let_in(need, d) for need, d in welcome["devices"].items()}
        nodes = {need: device.pop("nodes") for need, device in devices.items()}
        await self.link.meet({**welcome, "devices": devices, "device_nodes": nodes})
        said = await self.link.request("describe", {})
        description = PluginDescription.parse(said, where=self.spec.component)
        if differences := mismatches(self.spec.index, description, self.spec.component):
            raise WorkerFailed(*differences)
        await self.link.request("start", {})
        self._beat()

    async def attach(self, need: str, device: Mapping[str, Any]) -> None:
        """Grant it a device. Raises `WorkerFailed`, `LinkClosed`.

        One that is being pulled changes before it is withdrawn: what has lost a node is not told.
        """
        if not await asyncio.to_thread(_is_there, device):
            return
        found = await self._let_in(need, device)
        await self.link.request("attach", {"device": need, **found})

    async def detach(self, need: str) -> None:
        """Withdraw a device. Raises `WorkerFailed`, `LinkClosed`."""
        try:
            await self.link.request("detach", {"device": need})
        finally:
            for name in tuple(self._granted.pop(need, {})):
                await self._shut_out(name)

    async def look(self) -> tuple[Problem, ...]:
        """Look at what it uses: end it when that is too much, tell what is nearly."""
        reading = await self._reading()
        if self._ending is not None:
            return ()
        excess = self._watch.see(reading)
        if excess.end is not None:
            self.end(excess.end)
        return excess.strains

    async def behave(self, call: Call, values: Sequence[Any]) -> None:
        """Run a behaviour to its end, which the call is told."""
        body = {"behaviour": call.behaviour, "arguments": call.arguments, "values": values}
        try:
            pending = self.link.begin("behave", body)
        except NondumError as error:
            call.end(RunState.FAILED, problems.words(error))
            return
        self._calls[pending.id] = call
        call.when_halted(lambda: self._halt(pending, call.behaviour))
        try:
            call.end(*await self._outcome(pending, call))
        finally:
            del self._calls[pending.id]

    async def wait_for_beats(self, beats: int) -> None:
        """Wait for `beats` further heartbeats; return sooner when the worker is `gone`."""
        wanted = self._beats + beats
        while self._beats < wanted and not self.gone.done():
            self._beaten.clear()
            beaten: asyncio.Future[Any] = asyncio.ensure_future(self._beaten.wait())
            await asyncio.wait([beaten, self.gone], return_when=asyncio.FIRST_COMPLETED)
            beaten.cancel()

    async def stop(self, grace_s: float, problem: Problem) -> None:
        """Have the plugin leave everything safe, then end the process, all within `grace_s`.

        Cancelled, it ends the process sooner, and is over when nothing of it is left.
        """
        try:
            async with asyncio.timeout(grace_s * 0.7):
                await self.link.request("stop", {})
        except (TimeoutError, NondumError):
            pass  # it is ended all the same
        finally:
            self.end(problem, term_s=grace_s * 0.2)
            await self.ended()

    def end(self, problem: Problem, term_s: float = 0.0) -> None:
        """End the whole group, by SIGTERM first if it has `term_s` for that.

        Returns at once, see `gone`; the first problem told is why.
        """
        if self._ending is None:
            self._ending = self._loop.create_task(self._end(problem, term_s))

    async def ended(self) -> Problem:
        """Wait until nothing of it is left, and say why. Call it after `end`.

        Cancelling it does not shorten it: it takes seconds at most.
        """
        assert self._ending is not None
        await until_done(self._ending)
        return self.gone.result()

    async def _end(self, problem: Problem, term_s: float) -> None:
        if self._watchdog is not None:
            self._watchdog.cancel()
        is_exited = await self._process.end(term_s)
        self.link.close()
        if is_exited:
            self._close_outputs()
        try:
            await asyncio.to_thread(self._clear_away, problem)
        except OSError as error:  # what is left is the next sweep's
            left = f"not all that it left could be cleared away: {error}"
            self._emit(WorkerLogged(self.spec.component, "error", left))
        finally:
            self._close_outputs()
            self.gone.set_result(problem)

    def _clear_away(self, problem: Problem) -> None:
        """End what the process has started. Blocks. Raises `OSError`."""
        steps = _ends_of_all(self._process, self.spec)
        steps += [partial(self._withdraw, name) for name in tuple(self._reached)]
        if problem.code == problems.SCRATCH_FULL:  # the next worker needs space, and the host does
            steps.append(partial(scratch.empty, self.spec.scratch))
        clear_away(*steps)

    async def _end_by_itself(self) -> None:
        """Its link or process has ended: the other one will, or is ended."""
        await self._process.wait(self._timing.term_s)
        if self._process.exited.done():
            self._close_outputs()
            await self._end(self._why_exited(self._process.exited.result()), 0.0)
        else:
            await self._end(problems.hung_up(self.spec.component), 0.0)

    async def _let_in(self, need: str, device: Mapping[str, Any]) -> dict[str, Any]:
        """Have a device's nodes where the worker can open them, and no others that it had for that
        need; what it is told of that."""
        names = dict(zip(names_of(need, device["nodes"]), device["nodes"], strict=True))
        had = self._granted.get(need, {})
        for name in tuple(had):
            if name not in names or had[name] != names[name]["node"]:
                del had[name]
                await self._shut_out(name)
        inside = [{**n, "node": await self._open_up(need, name, n)} for name, n in names.items()]
        return {**inside[0], "nodes": inside}

    async def _open_up(self, need: str, name: str, device: Mapping[str, Any]) -> str:
        """Have one node where the worker can open it; where that is."""
        own = device["node"]
        self._reached.add(name)
        node = await asyncio.to_thread(self._reachable, name, own)
        if self._granted.setdefault(need, {}).get(name) != own:
            self._granted[need][name] = own
            try:
                await self._process.grant(name, node, own)
            except WorkerFailed as error:
                self._emit(WorkerLogged(self.spec.component, "error", str(error)))
        return self._process.node(name, node)

    async def _shut_out(self, name: str) -> None:
        """Take one node away."""
        await self._process.revoke(name)
        self._reached.discard(name)
        await asyncio.to_thread(self._withdraw, name)

    def _reachable(self, name: str, own: str) -> str:
        """The node that it may open, for one of the machine's. Blocks."""
        node = reachable(self.spec.component, name, own, self._process.user)
        self._lending.lend(name, node)
        return node

    def _withdraw(self, name: str) -> None:
        """Undo that. Blocks."""
        clear_away(
            partial(self._lending.take_back, name), partial(withdrawn, self.spec.component, name)
        )

    async def _reading(self) -> Reading:
        is_flowing = any(isinstance(claim, StreamFlowing) for claim in self.claims)
        is_asked = bool(self._calls) or is_flowing
        told = await self._process.open_files()

        def read() -> Reading:
            if told is None:
                descriptors = self._gauge.descriptors()
                used = scratch.used_bytes(self.spec.scratch, self._gauge.pids())
            else:
                descriptors = told.descriptors
                used = scratch.used_bytes(self.spec.scratch) + told.deleted_bytes
            return Reading(
                at_s=self._loop.time(),
                usage=self._gauge.usage(),
                descriptors=descriptors,
                wanted_s=self._gauge.wanted_s(),
                scratch_bytes=used,
                is_asked=is_asked,
            )

        return await asyncio.to_thread(read)  # hundreds of its threads are as many files to read

    def _why_exited(self, status: int) -> Problem:
        cgroup, said = self._process.cgroup, tuple(self._tail)
        usage = cgroup.usage() if cgroup is not None else Usage()
        exhausted = problems.exhausted(self.spec.component, self.spec.limits, usage, status, said)
        return exhausted or problems.exited(self.spec.component, status, said)

    def _close_outputs(self) -> None:
        for output in self._outputs:
            output.close()

    async def _outcome(self, pending: Pending, call: Call) -> tuple[RunState, str]:
        try:
            answer = parse_answer(await pending)
        except LinkClosed:
            problem = await asyncio.shield(self.gone)
            is_expected = call.is_halting or problem.code == problems.REMOVED
            return RunState.HALTED if is_expected else RunState.FAILED, str(problem)
        except WorkerFailed as error:
            is_halted = error.code == "HALTED"
            return RunState.HALTED if is_halted else RunState.FAILED, problems.words(error)
        return RunState.SUCCEEDED, answer

    def _halt(self, pending: Pending, behaviour: str) -> None:
        self.link.cancel(pending.id)
        self._loop.call_later(self._timing.halt_s, self._insist, pending, behaviour)

    def _insist(self, pending: Pending, behaviour: str) -> None:
        # the answer, not the call's state, which is a turn of the loop behind: a loop that was held
        # up reads the answer in the turn in which this timer is due
        if not pending.outcome.done():
            problem = problems.unhalted(self.spec.component, behaviour, self._timing.halt_s)
            self.end(problem, self._timing.term_s)

    def _beat(self) -> None:
        """It has just shown a sign of life."""
        if self._watchdog is not None:
            self._watchdog.cancel()
        if self._ending is None:
            self._watchdog = self._loop.call_later(self._timing.silence_s, self._on_silence)

    def _on_silence(self) -> None:
        place = self._standstill.place
        self.end(problems.silent(self.spec.component, self._timing.silence_s, place))

    def _on_event(self, name: str, body: dict[str, Any], call_id: int | None) -> None:
        if self._watchdog is not None:  # until it has started, only the startup probe counts
            self._beat()
        call = self._calls.get(call_id) if call_id is not None else None
        match name:
            case "heartbeat" | "pong":
                if name == "heartbeat":
                    self.rates = parse_rates(self._streams, body)
                self._beats += 1
                self._beaten.set()
                self._standstill.forget()
            case "established":
                if call is not None:  # it may come from a thread whose call has just ended
                    call.establish()
            case "crowded":
                self._on_crowded(parse_count(body))
            case "condition-ended":
                self._on_condition_ended(*parse_condition(self.spec.index, body))
            case "progress":
                progress = parse_progress(body)
                if call is not None:
                    event = BehaviourProgressed(call.component, call.behaviour, call.id, *progress)
                    self._emit(event)
            case _:
                self._on_news(name, body)

    def _on_news(self, name: str, body: dict[str, Any]) -> None:
        try:
            news = parse_news(self.spec.component, self._streams, name, body, self._value_types)
        except MessageInvalid as error:  # one wrong value is left out, and the worker goes on
            found = tuple(problems.located(self.spec.component, error))
            news = WorkerFaulted(self.spec.component, found)
            self._on_log(WorkerLogged(self.spec.component, "error", problems.words(error)))
        match news:
            case WorkerLogged():
                self._on_log(news)
            case WorkerFaulted():
                if self.faults.take(news):
                    self._emit(news)
            case _:
                self.claims.take(news)
                self._emit(news)

    def _on_condition_ended(self, condition: str, problem: Problem) -> None:
        """A condition will tell nothing any more; `tell_conditions` tells it again."""
        component = self.spec.component
        if problem.where:
            self.faults.end(condition, placed(component, problem.where))
        where = placed(f"{condition} of {component}", problem.where)
        self.dead_conditions[condition] = replace(problem, where=where)
        self.tell_conditions()

    def tell_conditions(self) -> None:
        """Tell of the conditions that have ended, also to those who were not there at the time."""
        for condition, problem in self.dead_conditions.items():
            self._emit(
                ConditionEnded(self.spec.component, condition, (problem,), self.spec.payload)
            )

    def _on_line(self, source: str, line: str) -> None:
        text = printable(line)
        if source == "stderr" and not self._standstill.take(line):
            self._tail.append(text)
        self._emit(WorkerLogged(self.spec.component, source, text))

    def _on_log(self, line: WorkerLogged) -> None:
        if self._log_valve.passes(len(line.message) + LINE_COST):
            if told := self._log_valve.told():
                self._emit(WorkerLogged(self.spec.component, "log", told))
            self._emit(line)

    def _on_foul(self, violation: ProtocolViolation) -> None:
        self.end(problems.foul(self.spec.component, violation))

    def _on_hang_up(self) -> None:
        if self._ending is None:
            self._ending = self._loop.create_task(self._end_by_itself())


async def start_worker(
    spec: WorkerSpec,
    welcome: Mapping[str, Any],
    *,
    launcher: Launcher,
    timing: Timing,
    emit: Callable[[Event], None],
    on_crowded: OnCrowded = lambda count: None,
    on_launched: Callable[[Worker], None] = lambda worker: None,
) -> Worker:
    """Launch a worker and see it through its start.

    Raises `WorkerFailed` with what went wrong; then, or when cancelled, however often, nothing of
    it is left.
    """
    worker = await _launched(spec, launcher, timing, emit, on_crowded)
    on_launched(worker)
    try:
        async with asyncio.timeout(timing.startup_s):
            await worker.introduce(welcome)
    except BaseException as error:
        worker.end(Problem("WORKER_START_FAILED", "it did not start", where=spec.component))
        problem = await worker.ended()
        match error:
            case LinkClosed():
                raise WorkerFailed(problems.before_start(problem)) from None
            case TimeoutError():
                raise WorkerFailed(problems.overdue(spec.component, timing.startup_s)) from None
            case ProtocolViolation():
                raise WorkerFailed(problems.foul(spec.component, error)) from error
            case WorkerFailed():
                raise WorkerFailed(*problems.located(spec.component, error)) from error
        raise
    return worker


async def _launched(
    spec: WorkerSpec,
    launcher: Launcher,
    timing: Timing,
    emit: Callable[[Event], None],
    on_crowded: OnCrowded,
) -> Worker:
    """A launched worker; what stands in the way only for now is waited for.

    Raises `WorkerFailed` (LAUNCH_FAILED, LAUNCH_CROWDED).
    """
    try:
        with contextlib.ExitStack() as failed:
            ours, theirs = link_sockets()
            failed.callback(ours.close)
            with theirs:
                process = await _process(spec, launcher, theirs, on_crowded)
            try:
                worker = Worker(spec, process, ours, timing, emit, on_crowded)
            except BaseException:
                await until_done(asyncio.create_task(_end_unread(process, spec)))
                raise
            failed.pop_all()
            return worker
    except OSError as error:
        problem = Problem("LAUNCH_FAILED", str(error), where=spec.component)
        raise WorkerFailed(problem) from error


async def _end_unread(process: WorkerProcess, spec: WorkerSpec) -> None:
    """End one that no `Worker` could be made of, and whatever it has started."""
    await process.end(0.0)
    for pipe in process.outputs:
        pipe.close()
    with contextlib.suppress(OSError):  # what is left is the next sweep's
        await asyncio.to_thread(clear_away, *_ends_of_all(process, spec))


def _ends_of_all(process: WorkerProcess, spec: WorkerSpec) -> list[Callable[[], object]]:
    """What ends all that a process has started; each may block, and raise `OSError`."""
    by_cgroup = [] if process.cgroup is None else [process.cgroup.end]
    return [*by_cgroup, partial(end_leftovers, spec.scratch)]


async def _process(
    spec: WorkerSpec, launcher: Launcher, sock: socket.socket, on_crowded: OnCrowded
) -> WorkerProcess:
    for _ in range(CROWDED_TRIES):
        try:
            return await launcher.launch(spec, sock)
        except WorkerFailed as error:
            if error.code != "LAUNCH_CROWDED":
                raise
        on_crowded(1)
        await asyncio.sleep(CROWDED_S)
    return await launcher.launch(spec, sock)


def _is_there(device: Mapping[str, Any]) -> bool:
    return all(Path(node["node"]).exists() for node in device["nodes"])
