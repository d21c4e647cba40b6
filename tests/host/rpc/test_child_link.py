"""The daemon asks a child, which blocks, and hears of what it does; a child that was taken over
breaks its own link only."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
from tests.kit.until import arrived

from nondum.host.rpc.channel import Channel, Tell
from nondum.host.rpc.child_link import ChildLink
from nondum.host.rpc.outcomes import packed, unpacked
from nondum.sdk.errors import DriveGone, LinkClosed, NondumError, Problem, ProtocolViolation
from nondum.sdk.pieces import cut
from nondum.sdk.wire import MAX_PACKET, Body, Event, Reply, Request, encode
from nondum.transport import link_sockets

pytestmark = pytest.mark.anyio

LIMIT = 4 * 1024 * 1024
PATIENCE_S = 10.0
"""Nothing here takes long."""


def do(verb: str, value: Any, tell: Tell) -> Any:
    match verb:
        case "refuse":
            raise DriveGone(Problem("DRIVE_GONE", value))
        case "tell":
            for number in range(value):
                tell("told", {"number": number})
        case "fail":
            raise LookupError(value)
    return value


@contextlib.asynccontextmanager
async def a_link(child: Callable[[socket.socket], None]) -> AsyncIterator[ChildLink]:
    """A link to a thread that stands for the child."""
    ours, theirs = link_sockets()
    link = ChildLink(ours, LIMIT)

    def live() -> None:
        with theirs, contextlib.suppress(LookupError, ConnectionError):
            child(theirs)

    thread = threading.Thread(target=live)
    thread.start()
    try:
        yield link
    finally:
        link.close()
        await asyncio.to_thread(thread.join)


def obedient(sock: socket.socket) -> None:
    Channel(sock, LIMIT).serve(do)


def saying(*packets: bytes) -> Callable[[socket.socket], None]:
    """A child that says this whatever it is asked."""

    def live(sock: socket.socket) -> None:
        sock.recv(1)
        for packet in packets:
            sock.send(packet)
        sock.recv(1)

    return live


async def ask(link: ChildLink, verb: str, value: Any) -> Any:
    return unpacked(await arrived("a reply", link.ask(verb, value), patience_s=PATIENCE_S))


async def test_child_answers_one_request_after_the_other() -> None:
    async with a_link(obedient) as link:
        for value in (None, "a", {"b": [1, 2.5]}):
            assert await ask(link, "give", value) == value


async def test_long_values_cross_both_ways() -> None:
    value = "long" * (LIMIT // 5)
    async with a_link(obedient) as link:
        assert await ask(link, "give", value) == value


async def test_too_long_a_value_is_not_sent() -> None:
    async with a_link(obedient) as link:
        with pytest.raises(ProtocolViolation) as violation:
            await ask(link, "give", "x" * (LIMIT + 1))
        assert violation.value.code == "PACKET_TOO_LONG"
        assert await ask(link, "give", 1) == 1


async def test_refusal_is_raised_and_the_child_goes_on() -> None:
    async with a_link(obedient) as link:
        with pytest.raises(DriveGone) as gone:
            await ask(link, "refuse", "pulled")
        assert gone.value.problems[0].message == "pulled"
        assert await ask(link, "give", 1) == 1


async def test_events_of_a_request_come_before_its_reply() -> None:
    told: list[tuple[str, Body]] = []
    async with a_link(obedient) as link:
        asked = link.ask("tell", 3, lambda name, body: told.append((name, body)))
        await arrived("a reply", asked, patience_s=PATIENCE_S)
    assert told == [("told", {"number": number}) for number in range(3)]


async def test_child_that_ends_is_told() -> None:
    async with a_link(obedient) as link:
        with pytest.raises(LinkClosed):
            await ask(link, "fail", "nothing")


@pytest.mark.parametrize(
    ("packets", "code"),
    [
        pytest.param([b"no piece"], "PACKET_MALFORMED", id="no piece"),
        pytest.param([b"\1no message"], "PACKET_MALFORMED", id="no message"),
        pytest.param([b"\0" + bytes(MAX_PACKET - 1)] * 70, "PACKET_TOO_LONG", id="too long"),
        pytest.param([*cut(encode(Reply(7, packed(1))))], "UNKNOWN_CALL", id="another call"),
        pytest.param([*cut(encode(Request(1, "give", {})))], "REQUEST_UNASKED", id="a request"),
        pytest.param([*cut(encode(Event("wrong", 1, {})))], "EVENT_UNKNOWN", id="an event"),
        pytest.param([*cut(encode(Reply(1, {})))], "PACKET_FIELDS", id="no reply"),
    ],
)
async def test_child_that_breaks_the_protocol_is_told(packets: list[bytes], code: str) -> None:
    def on_news(name: str, _body: Body) -> None:
        raise ProtocolViolation(Problem("EVENT_UNKNOWN", name))

    async with a_link(saying(*packets)) as link:
        with pytest.raises(NondumError) as violation:
            asked = link.ask("give", 1, on_news)
            unpacked(await arrived("a reply", asked, patience_s=PATIENCE_S))
        assert violation.value.code == code


async def test_child_that_tells_something_unasked_is_asked_no_more() -> None:
    event = encode(Event("told", 1, {}))
    async with a_link(saying(*cut(encode(Reply(1, packed(1)))), *cut(event))) as link:
        assert await ask(link, "give", 1) == 1
        with pytest.raises(ProtocolViolation) as violation:
            await ask(link, "give", 1)
        assert violation.value.code == "EVENT_UNKNOWN"
