"""One worker: a process and its link, from launch until both are gone."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

from nondum.host.core.events.event import Emit
from nondum.host.core.events.facts import StreamFlowing
from nondum.host.core.events.workers import WorkerLogged
from nondum.host.core.shielded import until_done
from nondum.host.sandbox.cgroups import Usage
from nondum.host.workers import problems, scratch
from nondum.host.workers.call import Call
from nondum.host.workers.device_access import DeviceAccess, is_there
from nondum.host.workers.heartbeats import Heartbeats
from nondum.host.workers.index import mismatches
from nondum.host.workers.leftovers import clear_away, ends_of_all
from nondum.host.workers.limits import Reading, Watch
from nondum.host.workers.news import parse_count
from nondum.host.workers.process import WorkerProcess
from nondum.host.workers.reports import Reports
from nondum.host.workers.running_calls import RunningCalls
from nondum.host.workers.spec import Timing, WorkerSpec
from nondum.host.workers.standard_streams import StandardStreams
from nondum.host.workers.usage import UsageReader
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation, WorkerFailed
from nondum.transport import WorkerLink

OnCrowded: TypeAlias = Callable[[int], None]


class Worker:
    """A launched worker. `start_worker` sees it through its start."""

    def __init__(
        self,
        spec: WorkerSpec,
        process: WorkerProcess,
        link: socket.socket,
        timing: Timing,
        emit: Emit,
        on_crowded: OnCrowded = lambda count: None,
    ) -> None:
        """Take over its process, and the host's end of its link.

        Raises `OSError` when they cannot be read: then they are still the caller's.
        `on_crowded` is called with how often descriptors could not be sent to it, or by it.
        """
        self.spec, self._timing, self._emit, self._on_crowded = spec, timing, emit, on_crowded
        self.since_wall_s = time.time()
        """When it was launched, in seconds since 1970."""
        self._loop = asyncio.get_running_loop()
        self._process = process
        self.reports = Reports(spec, emit)
        """What it says."""
        self._heartbeats = Heartbeats(timing.silence_s, self._on_silence)
        self._access = DeviceAccess(spec.component, process, emit)
        self._watch = Watch(spec.component, spec.limits, timing.spin_s)
        self._gauge = UsageReader(lambda: self.pid, process.cgroup)
        self._ending: asyncio.Task[None] | None = None
        self.gone: asyncio.Future[Problem] = self._loop.create_future()
        """Why the worker ended, once nothing of it is left."""
        with contextlib.ExitStack() as failed:
            self._streams = StandardStreams(spec.component, spec.package, process.outputs, emit)
            failed.callback(self._streams.close)
            self.link = self._open_link(link)
            failed.pop_all()
        self._calls = RunningCalls(
            spec.component, self.link, timing.halt_s, self.gone, self._on_unhalted
        )
        process.exited.add_done_callback(lambda _: self._on_hang_up())

    def _open_link(self, link: socket.socket) -> WorkerLink:
        return WorkerLink(
            link,
            on_event=self._on_event,
            on_closed=self._on_hang_up,
            on_violation=self._on_foul,
            on_crowded=lambda: self._on_crowded(1),
        )

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
        self.reports.expect(welcome["outputs"].values())
        given = welcome["devices"].items()
        # Once: who starts has `startup_s` for all of it.
        devices = {need: await self._access.let_in(need, device, times=1) for need, device in given}
        nodes = {need: device.pop("nodes") for need, device in devices.items()}
        await self.link.meet({**welcome, "devices": devices, "device_nodes": nodes})
        said = await self.link.request("describe", {})
        description = PluginDescription.parse(said, where=self.spec.component)
        if differences := mismatches(self.spec.index, description, self.spec.component):
            raise WorkerFailed(*differences)
        await self.link.request("start", {})
        self._heartbeats.begin()

    async def attach(self, need: str, device: Mapping[str, Any]) -> None:
        """Grant it a device. Raises `WorkerFailed`, `LinkClosed`.

        One that is being pulled changes before it is withdrawn: what has lost a node is not told.
        """
        if not await asyncio.to_thread(is_there, device):
            return
        found = await self._access.let_in(need, device)
        await self.link.request("attach", {"device": need, **found})

    async def detach(self, need: str) -> None:
        """Withdraw a device. Raises `WorkerFailed`, `LinkClosed`."""
        try:
            await self.link.request("detach", {"device": need})
        finally:
            await self._access.shut_out(need)

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
        await self._calls.behave(call, values)

    async def wait_for_beats(self, beats: int) -> None:
        """Wait for `beats` further heartbeats; return sooner when the worker is `gone`."""
        await self._heartbeats.wait(beats, self.gone)

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
        self._heartbeats.stop()
        is_exited = await self._process.end(term_s)
        self.link.close()
        if is_exited:
            self._streams.close()
        try:
            await asyncio.to_thread(self._clear_away, problem)
        except OSError as error:  # what is left is the next sweep's
            left = f"not all that it left could be cleared away: {error}"
            self._emit(WorkerLogged(self.spec.component, "error", left))
        finally:
            self._streams.close()
            self.gone.set_result(problem)

    def _clear_away(self, problem: Problem) -> None:
        """End what the process has started. Blocks. Raises `OSError`."""
        steps = ends_of_all(self._process.cgroup, self.spec.scratch)
        steps += self._access.withdrawals()
        if problem.code == problems.SCRATCH_FULL:  # the next worker needs space, and the host does
            steps.append(partial(scratch.empty, self.spec.scratch))
        clear_away(*steps)

    async def _end_by_itself(self) -> None:
        """Its link or process has ended: the other one will, or is ended."""
        await self._process.wait(self._timing.term_s)
        if self._process.exited.done():
            self._streams.close()
            await self._end(self._why_exited(self._process.exited.result()), 0.0)
        else:
            await self._end(problems.hung_up(self.spec.component), 0.0)

    def _why_exited(self, status: int) -> Problem:
        cgroup, said = self._process.cgroup, self._streams.tail
        usage = cgroup.usage() if cgroup is not None else Usage()
        exhausted = problems.exhausted(self.spec.component, self.spec.limits, usage, status, said)
        return exhausted or problems.exited(self.spec.component, status, said)

    async def _reading(self) -> Reading:
        is_flowing = any(isinstance(claim, StreamFlowing) for claim in self.reports.claims)
        is_asked = bool(self._calls) or is_flowing
        told = await self._process.open_files()
        return await asyncio.to_thread(  # hundreds of its threads are as many files to read
            self._gauge.reading, told, self.spec.scratch, self._loop.time, is_asked=is_asked
        )

    def _on_event(self, name: str, body: dict[str, Any], call_id: int | None) -> None:
        self._heartbeats.sign()
        call = self._calls.of(call_id)
        match name:
            case "heartbeat" | "pong":
                if name == "heartbeat":
                    self.reports.take_rates(body)
                self._heartbeats.beat()
                self._streams.standstill.forget()
            case "established":
                if call is not None:  # it may come from a thread whose call has just ended
                    call.establish()
            case "crowded":
                self._on_crowded(parse_count(body))
            case "condition-ended":
                self.reports.take_condition(body)
            case "progress":
                self.reports.take_progress(body, call)
            case _:
                self.reports.take_news(name, body)

    def _on_silence(self) -> None:
        place = self._streams.standstill.place
        self.end(problems.silent(self.spec.component, self._timing.silence_s, place))

    def _on_unhalted(self, problem: Problem) -> None:
        self.end(problem, self._timing.term_s)

    def _on_foul(self, violation: ProtocolViolation) -> None:
        self.end(problems.foul(self.spec.component, violation))

    def _on_hang_up(self) -> None:
        if self._ending is None:
            self._ending = self._loop.create_task(self._end_by_itself())
