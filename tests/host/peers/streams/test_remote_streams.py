"""A behaviour here reads a camera there: workers on two hosts, wired by name."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from tests.host.peers.streams.hosts import HERE, PATIENCE_S
from tests.host.workers.streaming import CAMERA, STREAM, WATCH, WATCHER, sees
from tests.kit.processes import is_alive, until_gone
from tests.kit.workers import WorkersUnderTest

from nondum.host.core.events.workers import WorkerReady
from nondum.host.jobs.children import Children
from nondum.host.peers.streams.bridge import Bridge
from nondum.host.peers.streams.remote_streams import RemoteStreams
from nondum.host.peers.streams.shared_streams import SharedStreams
from nondum.host.workers.workers import Workers
from nondum.planning.execute.running import RunState
from nondum.sdk.description import Output, Unit
from nondum.sdk.errors import HostUnreachable, NondumError, Problem, WorkerFailed
from nondum.sdk.messages import Image
from nondum.sdk.packets import SocketPackets
from nondum.sdk.streams import Consumer
from nondum.sdk.wire import MAX_PACKET, Body
from nondum.transport import link_sockets
from nondum.transport.peers import PeerKey

pytestmark = pytest.mark.anyio

BASE = PeerKey("the base's long-term key")
FRAMES = "rover__cam__frames"


class BaseWorkers(WorkersUnderTest):
    """Workers of another host than the rover."""

    def __post_init__(self) -> None:
        self.workers = Workers("base", self._on_event, timing=self.timing)


@dataclass
class Fleet:
    """A rover with cameras and a base that reads them; calls go straight to the other side."""

    rover: WorkersUnderTest
    base: WorkersUnderTest
    shared: SharedStreams
    rover_bridge: Bridge
    base_bridge: Bridge
    asked: list[tuple[str, Body]] = field(default_factory=list)
    is_linked: bool = True

    async def call(self, host: str, method: str, args: Body) -> Body:
        self.asked.append((method, args))
        if host != "rover" or not self.is_linked:
            raise HostUnreachable(Problem("PEER_DOWN", "there is no link to the peer", where=host))
        serve = self.shared.serve_open if method == "stream.open" else self.shared.serve_close
        return await serve(BASE, args)

    def calls(self, method: str) -> int:
        return sum(1 for asked, _ in self.asked if asked == method)

    async def camera(self, name: str = "cam") -> None:
        unit = Unit("camera", "camera", outputs=(Output("frames", "image"),))
        await self.rover.start(name, CAMERA, behaviours=(STREAM,), units=(unit,))
        stream = f"rover__{name}__frames"
        self.rover.behave(name, "stream", u=f"rover__{name}__camera", o=stream)

    async def watcher(self, name: str, stream: str = FRAMES) -> Any:
        await self.base.start(name, WATCHER, behaviours=(WATCH,), units=(Unit("eye", "detector"),))
        return self.base.behave(name, "watch", u=f"base__{name}__eye", i=stream)

    async def no_bridges(self) -> None:
        """Wait until both have ended."""
        for bridge in (self.rover_bridge, self.base_bridge):
            if bridge.pid is not None:
                await until_gone(bridge.pid)


@pytest.fixture
async def fleet(tmp_path: Path) -> AsyncIterator[Fleet]:
    rover, base = WorkersUnderTest(tmp_path / "rover"), BaseWorkers(tmp_path / "base")
    children = Children()
    bridges = (
        Bridge(children.forks, HERE, idle_s=0.5),
        Bridge(children.forks, HERE, idle_s=0.5),
    )
    shared = SharedStreams(bridges[0], rover.workers.streams)
    made = Fleet(rover, base, shared, *bridges)
    remote = RemoteStreams(
        bridges[1], made.call, lambda host: HERE if host == "rover" and made.is_linked else ()
    )
    base.workers.streams.reach(remote)
    yield made
    pids = [*base.workers.pids().values(), *rover.workers.pids().values()]
    await base.workers.close(grace_s=1.0)
    await remote.close()
    await rover.workers.close(grace_s=1.0)
    for bridge in bridges:
        await bridge.close()
    await children.close()
    assert not [pid for pid in pids if is_alive(pid)], "workers are left"


async def test_camera_of_a_peer_is_read_by_name(fleet: Fleet) -> None:
    await fleet.camera()
    await fleet.watcher("one")
    assert (await sees(fleet.base, "one")).arguments[2] == "rover__cam__camera"
    (status,) = fleet.base.workers.streams.listing()
    assert (status.stream, status.type, status.component) == (FRAMES, "image", "cam@rover")
    assert status.is_flowing
    assert status.readers == ("one",)
    assert fleet.shared.readers == {FRAMES: [BASE]}


async def test_two_readers_share_one_opening(fleet: Fleet) -> None:
    await fleet.camera()
    await fleet.watcher("one")
    await fleet.watcher("two")
    await sees(fleet.base, "one")
    await sees(fleet.base, "two")
    assert fleet.calls("stream.open") == 1
    (export,) = (await fleet.rover_bridge.figures())["exports"].values()
    (imported,) = (await fleet.base_bridge.figures())["imports"].values()
    assert imported["readers"] == ["one", "two"]
    assert export["frames"] > 0  # how they are coded depends on how busy this machine is


async def test_last_reader_closes_the_stream_and_the_bridges_end(fleet: Fleet) -> None:
    await fleet.camera()
    await fleet.watcher("one")
    await sees(fleet.base, "one", 0)
    fleet.base.workers.halt_all()
    await fleet.no_bridges()
    assert fleet.calls("stream.close") == 1
    assert fleet.shared.readers == {}
    assert fleet.base.workers.streams.listing() == ()
    (status,) = fleet.rover.workers.streams.listing()
    assert status.is_flowing, "reading it from afar changed nothing"


async def test_one_reader_less_leaves_the_other_readers(fleet: Fleet) -> None:
    await fleet.camera()
    call = await fleet.watcher("one")
    await fleet.watcher("two")
    await sees(fleet.base, "one", 0)
    call.halt()
    assert await call.ended() is RunState.HALTED
    await sees(fleet.base, "two", 60)
    assert fleet.calls("stream.open") == 1


@pytest.mark.parametrize("side", ["rover_bridge", "base_bridge"])
async def test_killed_bridge_is_replaced_while_somebody_reads(fleet: Fleet, side: str) -> None:
    await fleet.camera()
    call = await fleet.watcher("one")
    await sees(fleet.base, "one", 0)
    pid = getattr(fleet, side).pid
    os.kill(pid, signal.SIGKILL)
    await sees(fleet.base, "one", 100)
    assert getattr(fleet, side).pid not in (None, pid)
    assert not call.state.has_ended
    assert fleet.calls("stream.open") == 2


async def test_lost_caller_reads_no_more(fleet: Fleet) -> None:
    await fleet.camera()
    await fleet.watcher("one")
    await sees(fleet.base, "one", 0)
    fleet.is_linked = False
    await fleet.shared.caller_lost(BASE)
    assert fleet.shared.readers == {}
    assert (await fleet.rover_bridge.figures())["exports"] == {}
    fleet.is_linked = True
    await sees(fleet.base, "one", 100)


async def test_stream_of_no_peer_fails_the_call(fleet: Fleet) -> None:
    call = await fleet.watcher("one", "moon__cam__frames")
    assert await call.ended() is RunState.FAILED
    assert "STREAM_UNKNOWN" in call.reason
    assert fleet.asked == []


async def test_stream_that_the_peer_has_not_fails_the_call(fleet: Fleet) -> None:
    call = await fleet.watcher("one", "rover__gone__frames")
    assert await call.ended() is RunState.FAILED
    assert "STREAM_UNKNOWN" in call.reason
    assert fleet.base.workers.streams.listing() == ()


async def test_restarted_camera_is_read_again(fleet: Fleet) -> None:
    await fleet.camera()
    await fleet.watcher("one")
    await sees(fleet.base, "one", 0)
    os.kill(fleet.rover.workers.pids()["cam"], signal.SIGKILL)
    await fleet.rover.until(WorkerReady, lambda _: len(fleet.rover.told(WorkerReady)) == 2)
    fleet.rover.behave("cam", "stream", u="rover__cam__camera", o=FRAMES)
    await sees(fleet.base, "one", 60)


async def test_what_is_read_may_be_listened_in_on(fleet: Fleet) -> None:
    await fleet.camera()
    await fleet.watcher("one")
    await sees(fleet.base, "one", 0)
    ours, theirs = link_sockets()
    with theirs:
        await fleet.base.workers.streams.tap(FRAMES, theirs)
    heard = asyncio.Event()
    consumer = Consumer("image", SocketPackets(ours, MAX_PACKET), heard.set, lambda _: None)
    await asyncio.wait_for(heard.wait(), PATIENCE_S)
    assert isinstance(consumer.take(), Image)
    consumer.close()
    assert fleet.calls("stream.open") == 1


@pytest.mark.parametrize(
    ("args", "code"),
    [
        ({}, "STREAM_ARGUMENTS"),
        ({"stream": 7, "bridge": "x"}, "STREAM_ARGUMENTS"),
        ({"stream": FRAMES, "bridge": "short"}, "KEY_MALFORMED"),
        ({"stream": FRAMES, "bridge": "%" * 41}, "KEY_MALFORMED"),
        ({"stream": "rover__cam__nothing", "bridge": "0" * 40}, "STREAM_UNKNOWN"),
    ],
)
async def test_malformed_request_opens_nothing(fleet: Fleet, args: Body, code: str) -> None:
    with pytest.raises(NondumError) as refused:
        await fleet.shared.serve_open(BASE, args)
    assert refused.value.code == code
    assert fleet.rover_bridge.pid is None


async def test_peer_may_open_only_so_many(fleet: Fleet) -> None:
    await fleet.camera()
    args = {"stream": FRAMES, "bridge": "0" * 40}
    with pytest.raises(WorkerFailed, match="STREAM_TOO_MANY"):
        for _ in range(100):
            await fleet.shared.serve_open(BASE, args)
    await fleet.shared.caller_lost(BASE)
    assert (await fleet.rover_bridge.figures())["exports"] == {}


async def test_no_peer_closes_a_stream_that_another_has_opened(fleet: Fleet) -> None:
    await fleet.camera()
    opened = await fleet.shared.serve_open(BASE, {"stream": FRAMES, "bridge": "0" * 40})
    await fleet.shared.serve_close(PeerKey("another"), {"token": opened["token"]})
    await fleet.shared.serve_close(BASE, {"token": 7})
    assert fleet.shared.readers == {FRAMES: [BASE]}
    await fleet.shared.serve_close(BASE, {"token": opened["token"]})
    assert fleet.shared.readers == {}
