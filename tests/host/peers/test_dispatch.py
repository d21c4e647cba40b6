"""Calls of peers reach who carries them out, if anybody does; streams only if they are offered."""

from __future__ import annotations

import asyncio
import inspect

import pytest
from tests.host.peers.watcher import component, no_claims, snapshot
from tests.transport.fleet.fleets import mesh_member

from nondum.host.jobs.children import Children
from nondum.host.peers.dispatch import Dispatcher
from nondum.host.peers.offered_entries import Policy
from nondum.host.peers.peering import Peering
from nondum.host.peers.stream_requests import StreamRequests
from nondum.host.peers.streams.bridge import Bridge
from nondum.host.workers.streams import Streams
from nondum.sdk.errors import NondumError
from nondum.sdk.wire import Body
from nondum.transport.peers import Admission, CallFailed, HostKeys, IncomingCall, PeerKey, Trust
from nondum.transport.peers.messages import Request

pytestmark = pytest.mark.anyio

BRIDGE = HostKeys.generate().public


def incoming(method: str, args: Body) -> IncomingCall:
    admission = Admission(PeerKey("rover"), "rover", "pairing")
    return IncomingCall(admission, Request(1, 1, 60_000, method, args), lambda _, __: None)


async def test_call_that_is_not_known_is_refused() -> None:
    requests = Dispatcher()
    requests.add("echo", lambda asked: asked.args)
    assert requests.serve(incoming("echo", {"a": 1})) == {"a": 1}
    with pytest.raises(CallFailed, match="METHOD_UNKNOWN"):
        requests.serve(incoming("fly", {}))


@pytest.mark.parametrize(
    ("stream", "code"),
    [
        ("mule__watcher__image", "STREAM_UNKNOWN"),  # it is offered, and no component produces it
        ("mule__other__image", "NOT_OFFERED"),
        ("rover__watcher__image", "NOT_OFFERED"),
        (None, "NOT_OFFERED"),
    ],
)
async def test_only_streams_that_are_offered_are_opened(stream: str | None, code: str) -> None:
    fleet, _ = mesh_member("mule", None, Trust())
    here = snapshot(component())
    peering = Peering(
        "mule",
        fleet,
        lambda _: None,
        snapshot=lambda: here,
        policy=Policy,
        claims=no_claims,
        taken=dict,
        about={},
    )
    children, requests = Children(), Dispatcher()
    bridge = Bridge(children.forks, ("tcp://127.0.0.1:0",))
    streams = StreamRequests(bridge, Streams("mule"), peering, fleet, lambda: ())
    streams.serve(requests)
    answer = requests.serve(incoming("stream.open", {"stream": stream, "bridge": BRIDGE}))
    assert inspect.isawaitable(answer)
    with pytest.raises(NondumError) as refused:
        await asyncio.ensure_future(answer)
    assert refused.value.code == code
    assert bridge.pid is None
    assert children.server is None
    await streams.close()
    await fleet.close()
