"""A plugin on the test bench: a worker in this process, and the host's side of it in plain calls.

The plugin runs on a loop in a separate thread and is reached through the same codec as in a
worker process, so that what passes here passes there. Needs no Linux.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import threading
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

from nondum.sdk import source_check
from nondum.sdk.bench_host import HostSide, Run
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.geometry import Transform
from nondum.sdk.messages import Message, Vector, value_to_wire
from nondum.sdk.plugin import describe, load
from nondum.sdk.raised import held_up
from nondum.sdk.signature import parse_signature

TIMEOUT_S = 30.0
"""How long the bench waits for anything before the test fails."""
STOP_S = 10.0
"""How long it waits for the plugin's end. A host ends a worker sooner."""

_T = TypeVar("_T")


class Call:
    """A behaviour at work."""

    def __init__(self, bench: Bench, run: Run) -> None:
        self._bench, self._run = bench, run

    @property
    def state(self) -> str:
        """running, established, succeeded, failed or halted."""
        return self._run.state

    @property
    def problem(self) -> Problem | None:
        """Why it failed."""
        return self._run.problem

    @property
    def progress(self) -> list[tuple[float, str]]:
        """What it said about how far it is."""
        return list(self._run.progress)

    @property
    def answer(self) -> str:
        """What it answered when it succeeded: the text that it returned."""
        return self._run.answer

    @property
    def has_ended(self) -> bool:
        """Whether it runs no more."""
        return self.state in ("succeeded", "failed", "halted")

    def wait_established(self, timeout_s: float = TIMEOUT_S) -> Self:
        """Wait until it says that its effects hold; an `AssertionError` if it never does."""
        self._bench.wait_until(lambda: self.state != "running", "established", timeout_s)
        assert self.state == "established", f"ended before it was established: {self}"
        return self

    def wait(self, timeout_s: float = TIMEOUT_S) -> Self:
        """Wait until it ends."""
        self._bench.wait_until(lambda: self.has_ended, "the end of the behaviour", timeout_s)
        return self

    def halt(self, timeout_s: float = TIMEOUT_S) -> Self:
        """Halt it and wait until it has ended."""
        self._bench.on_loop(lambda: self._bench.side.link.cancel(self._run.pending.id))
        return self.wait(timeout_s)

    def assert_succeeded(self, timeout_s: float = TIMEOUT_S) -> Self:
        """Wait for its end and demand success."""
        assert self.wait(timeout_s).state == "succeeded", str(self)
        return self

    def assert_failed(self, code: str = "BEHAVIOUR_FAILED", timeout_s: float = TIMEOUT_S) -> Self:
        """Wait for its end and demand a failure with this code."""
        assert self.wait(timeout_s).state == "failed", str(self)
        assert self.problem is not None and self.problem.code == code, str(self)
        return self

    def __str__(self) -> str:
        return f"{self.state}: {self.problem}" if self.problem else self.state


class Bench:
    """One plugin, started. The `worker` fixture makes it and stops it.

    Everywhere a name is expected, the local name of one of the plugin's own units or output slots
    stands for its object.
    """

    def __init__(
        self,
        plugin: str | object,
        *,
        scratch: Path,
        host: str = "robot",
        component: str = "plugin",
        settings: Mapping[str, Any] | None = None,
        devices: Mapping[str, str] | None = None,
        mounts: Mapping[str, tuple[Vector, Vector]] | None = None,
        data: Mapping[str, Path] | None = None,
    ) -> None:
        """Load, describe and start a plugin.

        `plugin` is an entry point's value, a module, a class or an object. `devices`: declared name
        → node. `mounts`: unit → position in metres and roll, pitch, yaw in radians, on the body.
        `data`: declared name → a file, or a folder of files.
        Raises what the plugin's description or start hook raises, as `WorkerFailed`.
        """
        loaded = load(plugin)
        self._module = loaded.module
        self.description: PluginDescription = describe(loaded)
        """What the plugin says about itself."""
        self.host = host
        """The host's name, which is also its object and body frame."""
        units = [unit.name for unit in self.description.units]
        slots = [slot.name for unit in self.description.units for slot in unit.outputs]
        self.objects = {name: f"{host}__{component}__{name}" for name in (*units, *slots)}
        """Local names of units and output slots → objects."""
        self._changed = threading.Condition()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="bench")
        self._thread.start()
        self.side = self.on_loop(lambda: HostSide(plugin, self._notify))
        """The host's side; reach it through `on_loop` only."""
        welcome = {"host": host, "component": component, "scratch": str(scratch)}
        given = self._given(settings or {}, devices or {}, mounts or {})
        shown = {name: _shown(name, path) for name, path in (data or {}).items()}
        self._start({**welcome, **given, "data": shown})

    def _given(
        self,
        settings: Mapping[str, Any],
        devices: Mapping[str, str],
        mounts: Mapping[str, tuple[Vector, Vector]],
    ) -> dict[str, Any]:
        """What a plugin is given as it starts."""
        units = self.description.units
        return {
            "units": {unit.name: self.objects[unit.name] for unit in units},
            "outputs": {slot.name: self.objects[slot.name] for u in units for slot in u.outputs},
            "settings": dict(settings),
            "devices": {name: {"node": node, "properties": {}} for name, node in devices.items()},
            "mounts": {self._object(u): _mount(self.host, *at) for u, at in mounts.items()},
        }

    def _start(self, welcome: dict[str, Any]) -> None:
        try:
            answered = self._wait(self.side.start(welcome))
        except BaseException:
            self.stop()
            raise
        assert answered == self.description, "describing hooks must answer the same every time"

    @property
    def facts(self) -> dict[tuple[str, ...], Message | None]:
        """What the plugin said is true: (predicate, object, …) → value."""
        return dict(self.side.facts)

    @property
    def flowing(self) -> set[str]:
        """Objects of the streams that flow."""
        return set(self.side.flowing)

    @property
    def logs(self) -> list[tuple[str, str]]:
        """Level and message of what the plugin logged with `ctx.log`."""
        return list(self.side.logs)

    def behave(self, behaviour: str, **arguments: str) -> Call:
        """Start a behaviour with the action's parameters by name."""
        described = {b.name: b for b in self.description.behaviours}[behaviour]
        parameters = parse_signature(described.action).parameters
        names = {parameter.identifier: parameter.name for parameter in parameters}
        bound = {names.get(key, key): self._object(name) for key, name in arguments.items()}
        body = {"behaviour": behaviour, "arguments": bound, "values": []}
        return Call(self, self._wait(self.side.behave(body)))

    def feed(self, message: Message, *, stream: str = "", slot: str = "", unit: str = "") -> None:
        """Send a message on a stream that a behaviour reads, or to an optional input's slot."""
        stream = self._object(stream) if stream else f"fed-to-{slot}"
        self._wait(self.side.feed(message, stream, slot, unit))

    def read(self, slot: str, timeout_s: float = TIMEOUT_S) -> Any:
        """The next unread message of an output slot, waited for."""
        kept = self.side.outputs[self._object(slot)]
        self.wait_until(lambda: bool(kept), f"a message on {slot}", timeout_s)
        return kept.popleft()

    def drain(self, slot: str) -> list[Any]:
        """All unread messages of an output slot, now."""
        kept, drained = self.side.outputs[self._object(slot)], []
        while kept:
            drained.append(kept.popleft())
        return drained

    def set_value(self, predicate: str, *objects: str, value: Message) -> None:
        """Let a valued fact hold, as if another component had said so."""
        entry = [predicate, [self._object(name) for name in objects], value_to_wire(value)]
        self._tell("values", {"set": [entry], "unset": []})

    def unset_value(self, predicate: str, *objects: str) -> None:
        """Let a valued fact hold no more."""
        entry = [predicate, [self._object(name) for name in objects]]
        self._tell("values", {"set": [], "unset": [entry]})

    def wait_fact(self, predicate: str, *objects: str, timeout_s: float = TIMEOUT_S) -> Any:
        """Wait until the plugin says that a fact is true; give its value."""
        fact = (predicate, *map(self._object, objects))
        self.wait_until(lambda: fact in self.side.facts, f"({' '.join(fact)})", timeout_s)
        return self.facts[fact]

    def wait_until(
        self, is_so: Callable[[], bool], what: str, timeout_s: float = TIMEOUT_S
    ) -> None:
        """Wait for something that the plugin tells; an `AssertionError` after `timeout_s`."""
        with self._changed:
            found = self._changed.wait_for(lambda: is_so() or self.side.faults, timeout_s)
            self._fail_for_faults()
            if not found:
                raise AssertionError(f"waited {timeout_s} s in vain for {what}; logs: {self.logs}")

    def expect_fault(self, code: str, timeout_s: float = TIMEOUT_S) -> Problem:
        """Wait for a mistake of the plugin's: a wrong message (MESSAGE_FIELD …), or an error that
        ends a condition or spawned coroutine (CONDITION_RAISED, SPAWNED_RAISED). It fails the test
        no more."""
        with self._changed:
            self._changed.wait_for(lambda: self.side.faults, timeout_s)
            found = [problem for problem in self.side.faults if problem.code == code]
            assert found, f"no {code} was told, but: {self.side.faults}; logs: {self.logs}"
            self.side.faults.remove(found[0])
        return found[0]

    def attach(
        self,
        device: str,
        node: str,
        properties: Mapping[str, str] | None = None,
        *others: tuple[str, Mapping[str, str]],
    ) -> None:
        """Grant a device; `others` are further nodes of it, with their properties."""
        first = {"node": node, "properties": dict(properties or {})}
        nodes = [first, *({"node": path, "properties": dict(more)} for path, more in others)]
        self.ask("attach", device=device, nodes=nodes, **first)

    def show(self, name: str, path: Path) -> None:
        """Show data for a declared need: a file, or a folder of files."""
        self.ask("data", need=name, shown=_shown(name, path))

    def hide(self, name: str) -> None:
        """Show no data for a need any more."""
        self.ask("data", need=name, shown=None)

    def detach(self, device: str) -> None:
        """Take a device away."""
        self.ask("detach", device=device)

    def ask(self, verb: str, **body: Any) -> dict[str, Any]:
        """Ask like a host: `ask("speak", text="hello")`. Raises `WorkerFailed`."""
        return self._wait(self.side.link.request(verb, body))

    def stop(self) -> None:
        """Halt all, run the stop hook, and end. Stopping twice is allowed.

        A plugin whose code goes on all the same fails the test with WORKER_HUNG, and its lines.
        """
        if self._thread.is_alive():
            try:
                self._wait(self.side.stop(), STOP_S)
                self._fail_for_faults()
            finally:
                self._loop.call_soon_threadsafe(self._loop.stop)
                self._thread.join()
                self._loop.close()

    def on_loop(self, function: Callable[[], _T]) -> _T:
        """Call a function on the bench's loop and give its result."""

        async def called() -> _T:
            return function()

        return self._wait(called())

    def _fail_for_faults(self) -> None:
        """Raise `AssertionError` for a mistake of the plugin's that the test did not expect."""
        if self.side.faults:
            told = "\n".join(map(str, self.side.faults))
            self.side.faults.clear()
            raise AssertionError(f"the plugin made a mistake:\n{told}")

    def _tell(self, event: str, body: Mapping[str, Any]) -> None:
        self.on_loop(lambda: self.side.link.send_event(event, body))

    def _notify(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def _object(self, name: str) -> str:
        return self.objects.get(name, name)

    def _wait(self, work: Coroutine[Any, Any, _T], timeout_s: float = 2 * TIMEOUT_S) -> _T:
        future = asyncio.run_coroutine_threadsafe(work, self._loop)
        if not concurrent.futures.wait([future], timeout_s).done:
            future.cancel()
            places = "; ".join(held_up(self._module))
            where = f", held up in {places}" if places else ""
            told = f"it did not answer within {timeout_s:g} s{where}"
            fix = "wait with the context (`ctx.sleep`, `ctx.input(…).next`), which ends when halted"
            raise AssertionError(str(Problem("WORKER_HUNG", told, where=self._module, fix=fix)))
        return future.result()


class WorkerFactory:
    """What the `worker` fixture gives: call it with a plugin to get a started `Bench`."""

    def __init__(self, folder: Path, source: Path) -> None:
        """`folder` is where scratch folders are made, `source` the payload's source folder."""
        self._folder = folder
        self._source = source
        self._benches: list[Bench] = []

    def __call__(self, plugin: str | object, **options: Any) -> Bench:
        """Start a plugin; the options are those of `Bench`."""
        scratch = self._folder / f"scratch-{len(self._benches)}"
        scratch.mkdir()
        bench = Bench(plugin, scratch=scratch, **options)
        self._benches.append(bench)
        return bench

    def check(self, source: Path | None = None) -> None:
        """Check a payload's source folder as `nondum payload build` and hosts do: its manifest,
        goals, entry points, the plugins' answers, devices, fragments and phrases.

        `source` is, unless it is given, the nearest folder above the test that has a
        `payload.toml`. Raises `PayloadRefused` with everything that is wrong, each with its file
        and place. Needs the distribution nondum, too (CHECK_MISSING).
        """
        source_check.check(source or self._source)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with contextlib.ExitStack() as stopping:  # all of them, whatever one of them says
            for bench in self._benches:
                stopping.callback(bench.stop)


def _shown(name: str, path: Path) -> dict[str, Any]:
    """Data of a file, or of all files in a folder, as a host tells of them."""
    folder = path if path.is_dir() else path.parent
    found = sorted(path.rglob("*")) if path.is_dir() else [path]
    files = [str(file.relative_to(folder)) for file in found if file.is_file()]
    return {"name": name, "kind": "", "version": "0", "folder": str(folder), "files": files}


def _mount(host: str, xyz: Vector, rpy: Vector) -> list[Any]:
    transform = Transform.from_rpy(xyz, rpy)
    return [host, list(transform.translation), list(transform.rotation)]
