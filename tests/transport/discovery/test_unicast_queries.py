"""Hosts that multicast does not reach are asked, over real sockets on this machine."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from tests.kit.clock import VirtualClock
from tests.kit.until import until_async
from tests.transport.discovery.hosts import PATIENCE_S, Seeker, free_port, here, seeking

from nondum.sdk.errors import ConfigRefused
from nondum.transport.discovery import Announcement, Discovery, Source, StaticRow, packets
from nondum.transport.discovery.responder import BURST

pytestmark = pytest.mark.anyio


async def row(seeker: Seeker, *, code: str) -> StaticRow:
    """The static host's row, once it has a problem of this code."""

    def found() -> StaticRow | None:
        (row,) = seeker.discovery.status().static
        return row if row.problem is not None and row.problem.code == code else None

    await until_async("a host that is found", found)
    row = found()
    assert row is not None
    return row


def at(announcement: Announcement) -> str:
    return f"127.0.0.1:{announcement.port}"


class Asking(asyncio.DatagramProtocol):
    """A socket that asks by hand."""

    def __init__(self) -> None:
        self.answers: asyncio.Queue[bytes] = asyncio.Queue()

    def datagram_received(self, data: bytes, addr: object) -> None:
        self.answers.put_nowait(data)


async def asking(port: int) -> tuple[asyncio.DatagramTransport, Asking]:
    loop = asyncio.get_running_loop()
    return await loop.create_datagram_endpoint(Asking, remote_addr=("127.0.0.1", port))


async def test_a_static_host_is_found_where_it_was_asked() -> None:
    base = here("base")
    async with (
        seeking(base, multicast=False) as there,
        seeking(here("rover"), multicast=False, static=[at(base)]) as rover,
    ):
        hint = await rover.found(there)
        assert (hint.name, hint.source) == ("base", Source.STATIC)
        assert hint.addresses == (f"tcp://{at(base)}",)
        (asked,) = rover.discovery.status().static
        assert (asked.host, asked.name, asked.problem) == (at(base), "base", None)
        assert there.hints.empty()


async def test_a_name_is_resolved() -> None:
    base = here("base")
    static = [f"localhost:{base.port}"]
    async with (
        seeking(base, multicast=False) as there,
        seeking(here("rover"), multicast=False, static=static) as rover,
    ):
        assert f"tcp://{at(base)}" in (await rover.found(there)).addresses


async def test_a_host_that_comes_up_later_is_found() -> None:
    base = here("base")
    async with seeking(here("rover"), multicast=False, static=[at(base)]) as rover:
        silent = await row(rover, code="STATIC_SILENT")
        assert silent.problem is not None
        assert str(base.port) in silent.problem.fix
        async with seeking(base, multicast=False) as there:
            await rover.found(there)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    for wait in ("SLOW_WAIT_S", "LONGEST_WAIT_S", "ANSWER_S"):
        monkeypatch.setattr(f"nondum.transport.discovery.unicast_queries.{wait}", 0.1)
    monkeypatch.setattr("nondum.transport.discovery.discovery.RETRY_S", 0.1)


@pytest.mark.usefixtures("impatient")
async def test_a_host_that_was_exchanged_is_found_and_the_old_one_gone() -> None:
    old = here("base")
    new = replace(here("other"), listening=old.listening)
    async with seeking(here("rover"), multicast=False, static=[at(old)]) as rover:
        async with seeking(old, multicast=False) as there:
            await rover.found(there)
        async with seeking(new, multicast=False) as there:
            await rover.found(there)
            await rover.lost(old.key)


@pytest.mark.usefixtures("impatient")
async def test_a_host_that_answers_no_more_is_gone() -> None:
    base = here("base")
    async with seeking(here("rover"), multicast=False, static=[at(base)]) as rover:
        async with seeking(base, multicast=False) as there:
            await rover.found(there)
        await rover.lost(base.key)


async def test_an_unknown_host_name_is_reported() -> None:
    async with seeking(here("rover"), multicast=False, static=["unknown.invalid"]) as rover:
        told = await row(rover, code="STATIC_UNKNOWN")
        assert told.problem is not None and "peers.static" in told.problem.fix


@contextlib.contextmanager
def no_new_threads() -> Iterator[None]:
    """The system has no memory for the stack of one more."""
    before = threading.stack_size(1 << 46)
    try:
        yield
    finally:
        threading.stack_size(before)


async def test_a_name_is_resolved_once_there_are_threads_again(clock: VirtualClock) -> None:
    base = here("base")
    static = [f"localhost:{base.port}"]
    async with seeking(base, multicast=False) as there, contextlib.AsyncExitStack() as stack:
        with no_new_threads():
            rover = await stack.enter_async_context(
                seeking(here("rover"), multicast=False, static=static)
            )
            await clock.settle()
        (asked,) = rover.discovery.status().static
        assert asked.problem is not None and asked.problem.code == "STATIC_UNKNOWN"
        await clock.advance_until(rover.found(there))


async def test_a_host_with_itself_as_static_host_finds_no_peer() -> None:
    rover = here("rover")
    async with seeking(rover, multicast=False, static=[at(rover)]) as seeker:
        await until_async("the name", lambda: seeker.discovery.status().static[0].name == "rover")
        assert seeker.discovery.hints == {}
        assert seeker.discovery.status().problems == ()


async def test_without_keys_only_this_machine_is_asked() -> None:
    rover = here("rover", key="development:rover")
    async with seeking(rover, multicast=False, static=["192.0.2.1"]) as seeker:
        told = await row(seeker, code="STATIC_UNKNOWN")
        assert told.problem is not None and "this machine only" in told.problem.message


async def test_a_malformed_static_host_is_refused() -> None:
    with pytest.raises(ConfigRefused, match="STATIC_HOST"):
        Discovery(
            here("rover"), on_hint=lambda _: None, on_gone=lambda _: None, static=["tcp://base"]
        )


@pytest.mark.usefixtures("impatient")
async def test_a_port_that_is_taken_is_told_and_used_once_it_is_free() -> None:
    base = here("base")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", base.port))
        async with seeking(base, multicast=False) as there:
            (problem,) = there.discovery.status().problems
            assert (problem.code, problem.where) == ("ASKING_UNUSABLE", f"UDP port {base.port}")
            other.close()
            async with seeking(here("rover"), multicast=False, static=[at(base)]) as rover:
                await rover.found(there)


async def test_answers_follow_what_is_announced() -> None:
    base = here("base")
    async with seeking(base, multicast=False) as there:
        there.discovery.announce(replace(base, pairing_port=7411))
        async with seeking(here("rover"), multicast=False, static=[at(base)]) as rover:
            assert (await rover.found(there)).pairing_port == 7411


class TestStrangers:
    async def test_garbage_and_short_questions_are_not_answered(self) -> None:
        base = here("base")
        async with seeking(base, multicast=False):
            transport, stranger = await asking(base.port)
            whole = packets.question(bytes(packets.NONCE))
            for data in (b"", os.urandom(512), whole[:-1], whole + b"\0", whole[:60]):
                transport.sendto(data)
            last = os.urandom(packets.NONCE)
            transport.sendto(packets.question(last))
            async with asyncio.timeout(PATIENCE_S):
                assert packets.read_answer(await stranger.answers.get()).nonce == last
            transport.close()

    async def test_a_flood_of_questions_is_answered_at_a_bounded_rate(self) -> None:
        base = here("base")
        async with seeking(base, multicast=False):
            transport, stranger = await asking(base.port)
            for number in range(10 * int(BURST)):
                transport.sendto(packets.question(number.to_bytes(packets.NONCE)))
                if number % 50 == 0:
                    await asyncio.sleep(0)
            await stranger.answers.get()
            transport.close()
            assert stranger.answers.qsize() < 2 * BURST

    async def test_a_sender_that_has_not_seen_the_question_cannot_answer(self) -> None:
        port = free_port()
        loop = asyncio.get_running_loop()
        liar, _ = await loop.create_datagram_endpoint(Liar, local_addr=("127.0.0.1", port))
        static = [f"127.0.0.1:{port}"]
        async with seeking(here("rover"), multicast=False, static=static) as rover:
            await row(rover, code="STATIC_SILENT")
            assert rover.discovery.status().refused.keys() == {"HINT_MALFORMED"}
            assert rover.discovery.hints == {}
        liar.close()


class Liar(asyncio.DatagramProtocol):
    """Answers what was not asked, and no answer."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport: Any = transport

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        self.transport.sendto(packets.answer(bytes(packets.NONCE), here("evil")), addr)
        self.transport.sendto(b"nondum!1" + os.urandom(100), addr)
