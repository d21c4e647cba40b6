"""A bridge that cannot start, or has been closed, says so; what its child may tell is known."""

from __future__ import annotations

import asyncio
import contextlib
import os
import resource
import signal
from pathlib import Path

import pytest
from tests.host.peers.streams.hosts import bridge_of, forks
from tests.kit.clock import VirtualClock
from tests.kit.processes import process_ended
from tests.kit.until import until_async

from nondum.host.forking.fork_client import ForkClient
from nondum.host.peers.streams import process
from nondum.host.peers.streams.bridge import FORK_S, START_S, Bridge
from nondum.host.sandbox.levels import refusals
from nondum.sdk.errors import LinkClosed, ProtocolViolation, WorkerFailed

pytestmark = pytest.mark.anyio

ROOT = Path(__file__).parents[4]


async def started(bridge: Bridge) -> None:
    async with bridge.kept():
        pass


async def test_bridge_that_cannot_listen_says_so() -> None:
    async with forks() as client, bridge_of(client, ("tcp://203.0.113.9:0",)) as bridge:
        with pytest.raises(WorkerFailed, match="BRIDGE_START"):
            await started(bridge)
        assert bridge.pid is None


async def test_bridge_that_does_not_answer_in_time_says_so(
    clock: VirtualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    client = ForkClient("tests.host.peers.streams.server_of_silent_ones")
    async with bridge_of(client) as bridge:
        starting = asyncio.ensure_future(started(bridge))
        await until_async(
            "the answer of the fork server", lambda: any(map(is_held, forked_by(client)))
        )
        (silent,) = forked_by(client)
        with process_ended(silent) as ended:
            await clock.advance(START_S)
            with pytest.raises(WorkerFailed, match=f"{START_S:g} s") as failed:
                await starting
            await ended.wait()
        assert [problem.code for problem in failed.value.problems] == ["BRIDGE_START"]
        assert bridge.pid is None
    await client.close()


async def test_bridge_for_which_no_process_is_forked_in_time_says_so(clock: VirtualClock) -> None:
    async with forks() as client, bridge_of(client) as bridge:
        await bridge.expect()
        assert client.pid is not None
        os.kill(client.pid, signal.SIGSTOP)
        starting = asyncio.ensure_future(started(bridge))
        await clock.advance(FORK_S)
        with pytest.raises(WorkerFailed, match=f"{FORK_S:g} s") as failed:
            await starting
        assert [problem.code for problem in failed.value.problems] == ["BRIDGE_START"]
        assert bridge.pid is None


async def test_bridge_that_is_expected_is_imported_by_the_fork_server() -> None:
    async with forks() as client, bridge_of(client) as bridge:
        await bridge.expect()
        await until_async("the bridge's code", lambda: has_mapped(client, "zmq"))
        assert forked_by(client) == []
        await started(bridge)
        assert forked_by(client) == [bridge.pid]


async def test_bridge_that_is_expected_is_imported_by_the_next_fork_server_too() -> None:
    async with forks() as client, bridge_of(client) as bridge:
        await bridge.expect()
        former = client.pid
        assert former is not None
        with process_ended(former) as ended:
            os.kill(former, signal.SIGKILL)
            await ended.wait()
        (await client.fork("listing", FORK_S)).close()
        assert client.pid != former
        await until_async("the bridge's code", lambda: has_mapped(client, "zmq"))
        assert bridge.pid is None


@pytest.mark.skipif(not refusals.has_filters(), reason="knows no filters")
async def test_bridge_has_its_memory_bounded_and_more_calls_filtered_than_other_children() -> None:
    async with forks() as client, bridge_of(client) as bridge, bridge.kept():
        assert client.pid is not None and bridge.pid is not None
        most = (process.MEMORY_BYTES, process.MEMORY_BYTES)
        assert resource.prlimit(bridge.pid, resource.RLIMIT_DATA) == most
        assert resource.prlimit(bridge.pid, resource.RLIMIT_CORE) == (0, 0)
        assert filters(bridge.pid) == filters(client.pid) + 1


async def test_what_a_bridge_prints_goes_where_its_errors_go() -> None:
    async with forks() as client, bridge_of(client) as bridge, bridge.kept():
        held = Path(f"/proc/{bridge.pid}/fd")
        assert (held / "1").readlink() == (held / "2").readlink()
        assert (held / "0").readlink() == Path("/dev/null"), "nor does it inherit its link"


async def test_bridge_dies_with_its_fork_server_and_starts_again() -> None:
    async with forks() as client, bridge_of(client) as bridge:
        async with bridge.kept() as former:
            assert client.pid is not None
            os.kill(client.pid, signal.SIGKILL)
            await until_async("the bridge's end", lambda: bridge.pid is None)
        async with bridge.kept() as key:
            assert key != former


async def test_closed_bridge_starts_no_more() -> None:
    async with forks() as client:
        bridge = Bridge(client, ("tcp://127.0.0.1:0",))
        await bridge.close()
        with pytest.raises(LinkClosed):
            await started(bridge)
        assert bridge.pid is None


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("export_begun", {"token": "a"}),
        ("export_over", {"problem": {}}),
        ("export_over", {"token": 7, "problem": {}}),
        ("import_over", {"import": "7", "problem": {}}),
    ],
)
async def test_bridge_tells_nothing_else_than_ends(name: str, body: dict[str, object]) -> None:
    async with forks() as client, bridge_of(client) as bridge:
        with pytest.raises(ProtocolViolation, match="EVENT_UNKNOWN"):
            bridge._on_event(name, body, None)
        told = {"code": "STREAM_ENDED", "message": "enough"}
        bridge._on_event("export_over", {"token": "a", "problem": told}, None)
        bridge._on_event("import_over", {"import": 7, "problem": told}, None)


def forked_by(client: ForkClient) -> list[int]:
    server = client.pid
    if server is None:
        return []
    children = Path(f"/proc/{server}/task/{server}/children").read_text(encoding="ascii")
    return [int(pid) for pid in children.split()]


def is_held(pid: int) -> bool:
    """Whether this process has a pidfd of it (proc(5))."""
    for held in Path("/proc/self/fdinfo").iterdir():
        with contextlib.suppress(OSError):  # it was that of the listing
            if f"Pid:\t{pid}\n" in held.read_text(encoding="ascii"):
                return True
    return False


def filters(pid: int) -> int:
    """How many filters of system calls a process has (proc(5))."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(status.partition("Seccomp_filters:")[2].split()[0])


def has_mapped(client: ForkClient, package: str) -> bool:
    return f"/{package}/" in Path(f"/proc/{client.pid}/maps").read_text(encoding="utf-8")
