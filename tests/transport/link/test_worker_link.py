"""The host's end of a link: versions, requests and what a worker may not do."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import LinkClosed, Problem, ProtocolViolation, WorkerFailed
from nondum.sdk.link import Link
from nondum.sdk.packets import Handle, discard
from nondum.sdk.wire import PROTOCOL_VERSIONS, Event, Hello, Reply, Request, encode
from nondum.transport import WorkerLink, agreed_version, link_sockets

Serve = Callable[[str, dict[str, Any], tuple[Handle, ...]], Awaitable[dict[str, Any]]]


@dataclass
class Ends:
    """A host's end, the bare socket of its worker, and what the host was told."""

    sock: socket.socket
    events: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    violations: list[str] = field(default_factory=list)
    closed: asyncio.Event = field(default_factory=asyncio.Event)

    def send(self, *packets: bytes) -> None:
        for packet in packets:
            self.sock.send(packet)

    async def received(self) -> bytes:
        return await asyncio.get_running_loop().sock_recv(self.sock, 1 << 17)

    def serve(self, serve: Serve) -> Link:
        """Put the SDK's own link on the worker's end."""

        async def on_request(
            verb: str, body: dict[str, Any], handles: tuple[Handle, ...], _id: int
        ) -> dict[str, Any]:
            return await serve(verb, body, handles)

        return Link(
            self.sock, on_request, lambda *_: None, lambda: None, lambda _: None, max_handles=1
        )


@pytest.fixture
async def pair() -> AsyncIterator[tuple[WorkerLink, Ends]]:
    """Both ends of a fresh link."""
    ours, theirs = link_sockets()
    theirs.setblocking(False)
    ends = Ends(theirs)
    link = WorkerLink(
        ours,
        on_event=lambda name, body, _: ends.events.append((name, body)),
        on_closed=ends.closed.set,
        on_violation=lambda violation: ends.violations.append(violation.code),
    )
    yield link, ends
    link.close()
    theirs.close()


HELLO = Hello(PROTOCOL_VERSIONS, "0.1.0", 7)


@pytest.mark.anyio
async def test_worker_is_welcomed(pair: tuple[WorkerLink, Ends]) -> None:
    link, ends = pair
    ends.send(encode(HELLO))
    assert await link.meet({"host": "rover"}) == HELLO
    assert b"rover" in await ends.received()


@pytest.mark.anyio
async def test_version_from_elsewhere_is_refused(pair: tuple[WorkerLink, Ends]) -> None:
    link, ends = pair
    ends.send(encode(Hello((97, 96), "9.7", 7)))
    with pytest.raises(ProtocolViolation) as caught:
        await link.meet({})
    (problem,) = caught.value.problems
    assert (problem.code, problem.have) == ("PROTO_VERSION", "97, 96")


@given(st.sets(st.integers(0, 99), min_size=1))
def test_agreed_version_is_the_newest_common_one(offered: set[int]) -> None:
    common = offered & set(PROTOCOL_VERSIONS)
    hello = Hello(tuple(offered), "1", 1)
    if common:
        assert agreed_version(hello) == max(common)
    else:
        with pytest.raises(ProtocolViolation) as caught:
            agreed_version(hello)
        is_of_the_future = max(offered) > max(PROTOCOL_VERSIONS)
        assert caught.value.problems[0].fix.startswith("update" if is_of_the_future else "build")


@pytest.mark.anyio
async def test_descriptor_arrives_and_stays_the_sender_s(pair: tuple[WorkerLink, Ends]) -> None:
    link, ends = pair
    read, write = os.pipe()

    async def serve(verb: str, body: dict[str, Any], handles: tuple[Handle, ...]) -> dict[str, Any]:
        (handle,) = handles
        assert isinstance(handle, int)
        os.write(handle, verb.encode())
        discard(handles)
        return {"echo": body}

    worker = ends.serve(serve)
    assert await link.request("produce", {"a": 1}, (write,)) == {"echo": {"a": 1}}
    assert os.read(read, 9) == b"produce"
    os.fstat(write)
    worker.close()
    os.close(read)
    os.close(write)


@pytest.mark.anyio
async def test_failure_keeps_its_problem(pair: tuple[WorkerLink, Ends]) -> None:
    link, ends = pair
    problem = Problem("NO_LIGHT", "it is dark", fix="switch it on")

    async def serve(*_: object) -> dict[str, Any]:
        raise WorkerFailed(problem)

    worker = ends.serve(serve)
    with pytest.raises(WorkerFailed) as caught:
        await link.request("behave", {})
    assert caught.value.problems == (problem,)
    worker.close()


@pytest.mark.anyio
async def test_requests_fail_when_the_worker_goes(pair: tuple[WorkerLink, Ends]) -> None:
    link, ends = pair
    asking = asyncio.create_task(link.request("behave", {}))
    await ends.received()
    ends.sock.close()
    with pytest.raises(LinkClosed):
        await asking
    await ends.closed.wait()
    assert link.is_closed
    assert not ends.violations


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("packet", "code"),
    [
        pytest.param(b"\xc1 garbage", "PACKET_MALFORMED", id="garbage"),
        pytest.param(encode(Reply(5, {})), "UNKNOWN_CALL", id="answer to no call"),
        pytest.param(encode(Request(5, "mount", {})), "REQUEST_UNASKED", id="request"),
    ],
)
async def test_violation_closes_the_link(
    pair: tuple[WorkerLink, Ends], packet: bytes, code: str
) -> None:
    link, ends = pair
    ends.send(packet)
    await ends.closed.wait()
    assert ends.violations == [code]
    assert link.is_closed


async def flood(ends: Ends, packet: bytes) -> None:
    """Send a packet again and again, until the link is closed."""
    while not ends.closed.is_set():
        try:
            ends.sock.send(packet)
        except BlockingIOError:
            await asyncio.sleep(0)
        except (BrokenPipeError, ConnectionResetError):
            break
    await ends.closed.wait()


@pytest.mark.anyio
async def test_events_within_the_rate_limit_pass_and_a_flood_does_not(
    pair: tuple[WorkerLink, Ends],
) -> None:
    _, ends = pair
    packet = encode(Event("heartbeat", None, {}))
    loop = asyncio.get_running_loop()
    await flood(ends, packet)
    assert ends.violations == ["BACKPRESSURE"]
    assert 5000 <= len(ends.events) < 50_000
    assert loop.is_running()


@pytest.mark.anyio
async def test_uninvited_descriptor_is_closed(pair: tuple[WorkerLink, Ends]) -> None:
    _, ends = pair
    read, write = os.pipe()
    socket.send_fds(ends.sock, [encode(HELLO)], [write])
    os.close(write)
    await ends.closed.wait()
    assert ends.violations == ["PACKET_DESCRIPTORS"]
    assert os.read(read, 1) == b"", "the host holds no copy"
    os.close(read)


@pytest.mark.anyio
async def test_worker_that_never_reads_is_given_up_before_much_waits(
    pair: tuple[WorkerLink, Ends],
) -> None:
    link, ends = pair
    sent = 0
    while not link.is_closed:
        link.tell("values", {"set": ["x" * 60_000], "unset": []})
        sent += 60_000
    assert ends.violations == ["LINK_CONGESTED"]
    assert sent < 6 << 20


@pytest.mark.anyio
async def test_flood_of_bytes_ends_the_link_as_one_of_packets_does(
    pair: tuple[WorkerLink, Ends],
) -> None:
    _, ends = pair
    packet = encode(Event("log", None, {"message": "x" * 60_000}))
    await flood(ends, packet)
    assert ends.violations == ["BACKPRESSURE"]
    assert len(ends.events) < 2000
