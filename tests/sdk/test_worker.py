"""Workers as separate processes, with this test as their host."""

from __future__ import annotations

import asyncio
import socket
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk import LinkClosed, PluginDescription, Problem, WorkerFailed
from nondum.sdk.link import Link
from nondum.sdk.wire import PROTOCOL_VERSIONS

pytestmark = pytest.mark.anyio

ROOT = Path(__file__).parent.parent.parent
MAIN = "import sys; from nondum.sdk.worker import main; main(int(sys.argv[1]), *sys.argv[2:])"
GREETER, STUBBORN = "tests.sdk.greeter", "tests.sdk.stubborn"


class Worker:
    """A worker process, and the host's end of its link."""

    def __init__(self, name: str, process: asyncio.subprocess.Process, sock: socket.socket) -> None:
        self.name, self.process = name, process
        self.events: asyncio.Queue[tuple[str, dict[str, Any], int | None]] = asyncio.Queue()
        self.hung_up = asyncio.Event()
        self.link = Link(
            sock,
            self._refuse,
            lambda *event: self.events.put_nowait(event),
            self.hung_up.set,
            lambda violation: self.events.put_nowait(("violation", {"why": str(violation)}, None)),
        )

    @classmethod
    async def start(cls, plugin: str, name: str) -> Worker:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-c",
            MAIN,
            str(theirs.fileno()),
            plugin,
            "nondum-greeter",
            pass_fds=[theirs.fileno()],
            cwd=ROOT,
            stderr=asyncio.subprocess.PIPE,
        )
        theirs.close()
        return cls(name, process, ours)

    async def greet(self) -> None:
        hello = await self.link.hello()
        assert hello.pid == self.process.pid
        slots = {slot: f"robot__{self.name}__{slot}" for slot in ("words", "volume")}
        welcome = {"host": "robot", "component": self.name, "outputs": slots}
        self.link.welcome(PROTOCOL_VERSIONS[0], welcome)

    async def ready(self) -> Worker:
        await self.greet()
        await self.link.request("describe", {})
        await self.link.request("start", {})
        return self

    def behave(self, behaviour: str, **arguments: str) -> Any:
        body = {"behaviour": behaviour, "arguments": arguments, "values": []}
        return self.link.begin("behave", body)

    async def event(self, name: str) -> dict[str, Any]:
        """Wait for the next event of this name; those before it are dropped."""
        async with asyncio.timeout(60):
            while True:
                found, body, _ = await self.events.get()
                if found == name:
                    return body

    async def gone(self) -> int:
        return await asyncio.wait_for(self.process.wait(), 60)

    async def end(self) -> None:
        self.link.close()
        try:
            await asyncio.wait_for(self.process.wait(), 60)
        finally:
            if self.process.returncode is None:
                self.process.kill()
            await self.process.communicate()

    async def _refuse(self, *_request: Any) -> dict[str, Any]:
        raise WorkerFailed(Problem("VERB_UNKNOWN", "a host has no verbs"))


@pytest.fixture
async def worker() -> AsyncIterator[Callable[..., Awaitable[Worker]]]:
    workers: list[Worker] = []

    async def start(plugin: str = GREETER, name: str = "greeter") -> Worker:
        workers.append(await Worker.start(plugin, name))
        return workers[-1]

    yield start
    for one in workers:
        await one.end()


Start = Callable[..., Awaitable[Worker]]


async def test_worker_describes_its_plugin(worker: Start) -> None:
    one = await worker()
    await one.greet()
    answer = await one.link.request("describe", {})
    description = PluginDescription.parse(answer, where="test")
    assert description.name == "nondum-greeter"
    assert [behaviour.name for behaviour in description.behaviours][:2] == ["await-hint", "count"]


async def test_worker_beats_and_answers_pings(worker: Start) -> None:
    one = await worker()
    await one.greet()
    await one.event("heartbeat")
    one.link.send_event("ping", {})
    await one.event("pong")


async def test_what_the_host_tells_first_is_not_lost(worker: Start) -> None:
    one = await worker()
    bearing = {"header": {}, "direction": [1, 0, 0], "sigma_rad": 0.1}
    await one.greet()
    known = [["bearing-known", ["gate", "robot"], ["bearing", bearing]]]
    one.link.send_event("values", {"set": known, "unset": []})
    one.link.send_event("mounts", {"mouth": ["robot", [0, 0, 1], [0, 0, 0, 1]]})
    await one.link.request("describe", {})
    call = one.behave("turn", **{"u": "mouth", "to-where": "gate"})
    with pytest.raises(WorkerFailed) as caught:
        await call
    assert caught.value.code == "FRAME_UNKNOWN", "the value was there; its frame is ''"


async def test_workers_pass_streams_without_the_host(worker: Start) -> None:
    singer = await (await worker(GREETER, "singer")).ready()
    echoer = await (await worker(GREETER, "echoer")).ready()
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    stream = {"stream": "robot__singer__words", "type": "text"}
    await singer.link.request("produce", {**stream, "consumer": "echoer"}, (ours.fileno(),))
    await echoer.link.request("consume", stream, (theirs.fileno(),))
    ours.close()
    theirs.close()
    echo = echoer.behave("echo", u="m", i="robot__singer__words", o="robot__echoer__words")
    sing = singer.behave("sing", u="m", o="robot__singer__words")
    flow = await echoer.event("flow")
    while flow["stream"] != "robot__echoer__words":
        flow = await echoer.event("flow")
    assert flow["flowing"]
    for one, call in ((singer, sing), (echoer, echo)):
        one.link.cancel(call.id)
        with pytest.raises(WorkerFailed, match="HALTED"):
            await call


@pytest.mark.slow
async def test_output_that_stalls_does_not_flow(worker: Start) -> None:
    one = await (await worker()).ready()
    assert await one.event("flow") == {"stream": "robot__greeter__volume", "flowing": True}
    assert await one.event("flow") == {"stream": "robot__greeter__volume", "flowing": False}


async def test_worker_stops_when_told(worker: Start) -> None:
    one = await (await worker()).ready()
    sing = one.behave("sing", u="m", o="robot__greeter__words")
    await one.event("established")
    await one.link.request("stop", {})
    with pytest.raises(WorkerFailed, match="HALTED"):
        await sing
    await one.event("know")
    one.link.close()
    assert await one.gone() == 0


async def test_worker_ends_with_its_host(worker: Start) -> None:
    one = await (await worker()).ready()
    one.link.close()
    assert await one.gone() == 0


async def test_stuck_thread_does_not_keep_the_process(worker: Start) -> None:
    one = await (await worker(STUBBORN)).ready()
    one.behave("refuse-to-halt", u="mule")
    await one.event("established")
    one.link.close()
    assert await one.gone() == 0


@pytest.mark.parametrize(
    ("behaviour", "told"),
    [("exit", "SystemExit: leaving"), ("stop-iterating", "StopIteration")],
)
async def test_odd_exits_are_failures(worker: Start, behaviour: str, told: str) -> None:
    one = await (await worker(STUBBORN)).ready()
    with pytest.raises(WorkerFailed, match=told) as caught:
        await one.behave(behaviour, u="mule")
    assert caught.value.code == "BEHAVIOUR_RAISED"


async def test_death_closes_the_link(worker: Start) -> None:
    one = await (await worker(STUBBORN)).ready()
    with pytest.raises(LinkClosed):
        await one.behave("die", u="mule")
    assert await one.gone() == 7


async def test_flood_of_logs_breaks_nothing(worker: Start) -> None:
    one = await (await worker(STUBBORN)).ready()
    with pytest.raises(WorkerFailed, match="hoarse"):
        await one.behave("shout", u="mule")
    first = await one.event("log")
    assert first == {"level": "warning", "message": "hee-haw 0"}
    left_out = await one.event("log")
    while "left out" not in left_out["message"]:
        left_out = await one.event("log")
    assert not one.link.is_closed


async def test_hook_that_raises_is_told(worker: Start) -> None:
    one = await (await worker(STUBBORN)).ready()
    with pytest.raises(WorkerFailed, match=r"'translate_goal' .*KeyError") as caught:
        await one.link.request("translate_goal", {"words": "fly"})
    assert caught.value.code == "HOOK_FAILED"


async def test_import_error_is_told_with_its_place(worker: Start, tmp_path: Path) -> None:
    one = await worker("tests.sdk.no_such_module")
    await one.greet()
    with pytest.raises(WorkerFailed) as caught:
        await one.link.request("describe", {})
    assert caught.value.code == "IMPORT_FAILED"
    assert "'tests.sdk.no_such_module'" in str(caught.value)


async def test_unknown_version_ends_the_worker(worker: Start) -> None:
    one = await worker()
    await one.link.hello()
    one.link.welcome(99, {"host": "robot", "component": "c"})
    assert await one.gone() == 1
    assert one.process.stderr is not None
    assert b"version 99 is unknown" in await one.process.stderr.read()
