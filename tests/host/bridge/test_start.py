"""A bridge that cannot start, or has been closed, says so; what its child may tell is known."""

from __future__ import annotations

import asyncio

import pytest
from tests.kit.clock import VirtualClock

from nondum.host.bridge.bridge import START_S, Bridge
from nondum.sdk.errors import LinkClosed, ProtocolViolation, WorkerFailed

pytestmark = pytest.mark.anyio


async def test_bridge_that_cannot_listen_says_so() -> None:
    bridge = Bridge(("tcp://203.0.113.9:0",))
    with pytest.raises(WorkerFailed, match="BRIDGE_START"):
        async with bridge.kept():
            pass
    assert bridge.pid is None
    await bridge.close()


async def test_bridge_that_does_not_answer_in_time_says_so(clock: VirtualClock) -> None:
    bridge = Bridge(("tcp://127.0.0.1:0",))

    async def kept() -> None:
        async with bridge.kept():
            pass

    starting = asyncio.ensure_future(kept())
    await clock.advance(START_S)  # sooner than any process is there
    with pytest.raises(WorkerFailed, match=f"{START_S:g} s") as failed:
        await starting
    assert [problem.code for problem in failed.value.problems] == ["BRIDGE_START"]
    assert bridge.pid is None
    await bridge.close()


async def test_closed_bridge_starts_no_more() -> None:
    bridge = Bridge(("tcp://127.0.0.1:0",))
    await bridge.close()
    with pytest.raises(LinkClosed):
        async with bridge.kept():
            pass
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
    bridge = Bridge(("tcp://127.0.0.1:0",))
    with pytest.raises(ProtocolViolation, match="EVENT_UNKNOWN"):
        bridge._on_event(name, body, None)
    told = {"code": "STREAM_ENDED", "message": "enough"}
    bridge._on_event("export_over", {"token": "a", "problem": told}, None)
    bridge._on_event("import_over", {"import": 7, "problem": told}, None)
    await bridge.close()
