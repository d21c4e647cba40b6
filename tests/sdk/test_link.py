"""Worker links over real sockets: calls, cancellations, back-pressure, hostile other ends."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Iterator
from typing import Any, TypeAlias

import pytest

from nondum.sdk import BehaviourFailed, LinkClosed, Problem, ProtocolViolation, WorkerFailed
from nondum.sdk.link import MAX_WAITING, Link
from nondum.sdk.packets import Handle, discard
from nondum.sdk.wire import MAX_PACKET, Cancel, Event, Hello, Reply, Request, Welcome, encode

pytestmark = pytest.mark.anyio

PROBLEMS = (Problem("A", "a", where="here"), Problem("B", "b", need="1", have="0", fix="do"))


class End:
    """One end of a link that notes what happens to it."""

    def __init__(self, sock: socket.socket, *, credit: int = 64, max_handles: int = 0) -> None:
        self.events: asyncio.Queue[tuple[str, dict[str, Any], int | None]] = asyncio.Queue()
        self.violations: list[str] = []
        self.closed = asyncio.Event()
        self.halted: list[int] = []
        self.started = asyncio.Event()
        self.link = Link(
            sock,
            self.serve,
            lambda *event: self.events.put_nowait(event),
            self.closed.set,
            lambda violation: self.violations.append(violation.code),
            credit,
            max_handles=max_handles,
        )

    async def serve(
        self, verb: str, body: dict[str, Any], handles: tuple[Handle, ...], call_id: int
    ) -> dict[str, Any]:
        self.started.set()
        match verb:
            case "echo":
                return body
            case "wait":
                try:
                    await asyncio.Event().wait()
                except asyncio.CancelledError:
                    self.halted.append(call_id)
                    raise
            case "fail":
                raise BehaviourFailed("no light")
            case "refuse":
                raise WorkerFailed(*PROBLEMS)
            case "crash":
                raise ZeroDivisionError("oops")
            case "big":
                return {"a": "x" * MAX_PACKET}
            case "odd":
                return {"a": object()}
            case "write":
                assert isinstance(handles[0], int)
                os.write(handles[0], b"from the other end")
        discard(handles)
        return {}


Pair: TypeAlias = tuple[socket.socket, socket.socket]


def pair() -> Pair:
    return socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)


@pytest.fixture
async def ends() -> Any:
    ours, theirs = pair()
    host, worker = End(ours), End(theirs, max_handles=1)
    yield host, worker
    host.link.close()
    worker.link.close()


@pytest.fixture
def hostile() -> Iterator[Pair]:
    """A plain socket to send anything with, and what it is connected to."""
    ours, theirs = pair()
    yield ours, theirs
    ours.close()
    theirs.close()


async def test_request_is_answered(ends: tuple[End, End]) -> None:
    host, worker = ends
    assert await host.link.request("echo", {"n": 1}) == {"n": 1}
    assert await worker.link.request("echo", {"n": [2]}) == {"n": [2]}


async def test_many_requests_share_the_credit(ends: tuple[End, End]) -> None:
    host, _ = ends
    answers = await asyncio.gather(*(host.link.request("echo", {"n": n}) for n in range(500)))
    assert [answer["n"] for answer in answers] == list(range(500))


@pytest.mark.parametrize(
    ("verb", "code"),
    [
        ("fail", "BEHAVIOUR_FAILED"),
        ("crash", "INTERNAL"),
        ("big", "ANSWER_UNSENDABLE"),
        ("odd", "ANSWER_UNSENDABLE"),
    ],
)
async def test_failure_carries_its_code(ends: tuple[End, End], verb: str, code: str) -> None:
    host, _ = ends
    with pytest.raises(WorkerFailed) as caught:
        await host.link.request(verb, {})
    assert caught.value.code == code


async def test_cancel_halts_and_is_answered(ends: tuple[End, End]) -> None:
    host, worker = ends
    call = host.link.begin("wait", {})
    await worker.started.wait()
    host.link.cancel(call.id)
    with pytest.raises(WorkerFailed) as caught:
        await call
    assert caught.value.code == "HALTED"
    assert worker.halted == [call.id]


async def test_cancel_before_the_first_step_is_answered(ends: tuple[End, End]) -> None:
    host, _ = ends
    call = host.link.begin("wait", {})
    host.link.cancel(call.id)
    with pytest.raises(WorkerFailed) as caught:
        await call
    assert caught.value.code == "HALTED"


async def test_cancelled_caller_cancels_the_request(ends: tuple[End, End]) -> None:
    host, worker = ends
    task = asyncio.create_task(host.link.request("wait", {}))
    await worker.started.wait()
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert await host.link.request("echo", {}) == {}
    assert len(worker.halted) == 1


async def test_caller_waits_for_credit() -> None:
    ours, theirs = pair()
    host, worker = End(ours, credit=1), End(theirs)
    waiting = host.link.begin("wait", {})
    with pytest.raises(ProtocolViolation, match="NO_CREDIT"):
        host.link.begin("echo", {})
    queued = [asyncio.create_task(host.link.request("echo", {"n": n})) for n in range(3)]
    await worker.started.wait()
    queued[0].cancel()
    host.link.cancel(waiting.id)
    assert [await task for task in queued[1:]] == [{"n": 1}, {"n": 2}]
    host.link.close()
    worker.link.close()


async def test_events_arrive_in_order(ends: tuple[End, End]) -> None:
    host, worker = ends
    for n in range(300):
        worker.link.send_event("progress", {"n": n}, call_id=7)
    arrived = [await host.events.get() for _ in range(300)]
    assert arrived == [("progress", {"n": n}, 7) for n in range(300)]


async def test_descriptor_travels_with_a_request(ends: tuple[End, End]) -> None:
    host, _ = ends
    reading, writing = os.pipe()
    await host.link.request("write", {}, (writing,))
    os.close(writing)
    assert os.read(reading, 100) == b"from the other end"
    os.close(reading)


async def test_full_socket_is_back_pressure(hostile: Pair) -> None:
    raw, other = hostile
    end = End(other)
    reading, writing = os.pipe()
    sent = 0
    while sent < 1000:
        end.link.send_event("fill", {"n": sent, "text": "x" * 1000})
        sent += 1
    call = end.link.begin("write", {}, (writing,))
    os.close(writing)  # the waiting packet holds a duplicate
    loop = asyncio.get_running_loop()
    raw.setblocking(False)
    for _ in range(sent):
        await loop.sock_recv(raw, MAX_PACKET)
    while True:  # the packet may not have been sent yet
        try:
            data, handles, _, _ = socket.recv_fds(raw, MAX_PACKET, 4)
            break
        except BlockingIOError:
            await asyncio.sleep(0)
    assert data == encode(Request(call.id, "write", {}))
    os.write(handles[0], b"late")
    assert os.read(reading, 100) == b"late"
    for descriptor in (reading, *handles):
        os.close(descriptor)
    end.link.close()


@pytest.mark.parametrize(("count", "size"), [(MAX_WAITING + 1000, 10), (100, 60_000)])
async def test_end_that_never_reads_is_given_up(hostile: Pair, count: int, size: int) -> None:
    """Be what waits for it many packets or long ones."""
    _, other = hostile
    end = End(other)
    for _ in range(count):
        end.link.send_event("fill", {"text": "x" * size})
    assert end.violations == ["LINK_CONGESTED"]
    assert end.closed.is_set()


async def test_closing_fails_what_waits(ends: tuple[End, End]) -> None:
    host, worker = ends
    call = host.link.begin("wait", {})
    await worker.started.wait()
    worker.link.close()
    with pytest.raises(LinkClosed):
        await call
    await host.closed.wait()
    assert not host.violations
    with pytest.raises(LinkClosed):
        await host.link.request("echo", {})
    host.link.send_event("into", {"the": "void"})


async def test_handshake_goes_first() -> None:
    ours, theirs = pair()
    host, worker = End(ours), End(theirs)
    greeting = asyncio.create_task(worker.link.greet(Hello((2, 1), "0.1.0", 42)))
    assert await host.link.hello() == Hello((2, 1), "0.1.0", 42)
    host.link.welcome(1, {"host": "robot"})
    assert await greeting == Welcome(1, {"host": "robot"})
    host.link.close()
    worker.link.close()


async def test_host_that_says_hello_is_refused(hostile: Pair) -> None:
    raw, other = hostile
    end = End(other)
    raw.send(encode(Hello((1,), "1", 1)))
    with pytest.raises(ProtocolViolation, match="HANDSHAKE"):
        await end.link.greet(Hello((1,), "1", 1))
    end.link.close()


async def test_worker_that_welcomes_is_refused(hostile: Pair) -> None:
    raw, other = hostile
    end = End(other)
    raw.send(encode(Welcome(1, {})))
    with pytest.raises(ProtocolViolation, match="HANDSHAKE"):
        await end.link.hello()
    end.link.close()


HOSTILE = {
    "garbage": ([b"\xff\xff\xff"], "PACKET_MALFORMED"),
    "too long": ([bytes(MAX_PACKET + 1)], "PACKET_TOO_LONG"),
    "much too long": ([bytes(2 * MAX_PACKET)], "PACKET_TOO_LONG"),
    "reply without call": ([encode(Reply(1, {}))], "UNKNOWN_CALL"),
    "handshake twice": ([encode(Hello((1,), "1", 1))] * 2, "HANDSHAKE"),
    "call twice": ([encode(Request(1, "wait", {}))] * 2, "CALL_TWICE"),
    "no credit": ([encode(Request(n, "wait", {})) for n in range(1, 66)], "NO_CREDIT"),
}


@pytest.mark.parametrize(("packets", "code"), HOSTILE.values(), ids=HOSTILE)
async def test_hostile_end_is_cut_off(hostile: Pair, packets: list[bytes], code: str) -> None:
    raw, other = hostile
    end = End(other)
    for packet in packets:
        raw.send(packet)
    await end.closed.wait()
    assert end.violations == [code]
    assert end.link.is_closed


async def test_unrequested_descriptors_are_closed(hostile: Pair) -> None:
    raw, other = hostile
    end = End(other)
    reading, writing = os.pipe()
    socket.send_fds(raw, [encode(Event("log", None, {}))], [writing])
    os.close(writing)
    await end.closed.wait()
    assert end.violations == ["PACKET_DESCRIPTORS"]
    assert os.read(reading, 1) == b"", "the link holds no descriptor any more"
    os.close(reading)


async def test_too_many_descriptors_are_closed(hostile: Pair) -> None:
    raw, other = hostile
    end = End(other, max_handles=1)
    reading, writing = os.pipe()
    socket.send_fds(raw, [encode(Request(1, "echo", {}))], [writing] * 100)
    os.close(writing)
    await end.closed.wait()
    assert end.violations == ["PACKET_DESCRIPTORS"]
    assert os.read(reading, 1) == b""
    os.close(reading)


async def test_flood_does_not_starve_the_loop(hostile: Pair) -> None:
    raw, other = hostile
    end = End(other)
    raw.setblocking(False)
    turns = 0
    for _ in range(50):
        try:
            while True:
                raw.send(encode(Cancel(1)))
        except BlockingIOError:
            pass
        await asyncio.sleep(0)
        turns += 1
    assert turns == 50
    assert not end.violations
    end.link.close()


async def test_all_problems_survive_the_link(ends: tuple[End, End]) -> None:
    host, _ = ends
    with pytest.raises(WorkerFailed) as caught:
        await host.link.request("refuse", {})
    assert caught.value.problems == PROBLEMS
